#pragma once

// Learns the noise from the residuals at the minimum of the cost on the present expansion: its
// scale if unknown, the time constant of its correlation, and the point at which outliers are
// judged. The result is the noise with which to weigh the record next. Taking the sums again with
// it changes the minimum, so the caller repeats this until nothing is left to revise.
//
//   scale        s² ← s² (χ² − D)/(N − D − p). D is the expansion's own share of χ², and p the
//                channel's share of the number of fitted parameters Σ λ/(1 + λ). In one revision
//                s² falls at most by a factor 4 and rises at most by a factor 16.
//   correlation  a ← a + 0.6 (x − a) for a = exp(−Δt/τ) at the mean interval Δt. x is the noise
//                correlation that explains the lag-1 correlation r which the whitened residuals
//                still have (after removing its bias), r = (x − a)(1 − a x)/(1 − 2 a x + a²). The
//                step is taken while x − a is significant. From white noise, a ← r.
//
// Neither is learned before there are kMinSamplesForNoise + 4 n samples.

#include <absl/status/statusor.h>

#include <optional>

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/record/record_summary.h"
#include "polyest/stop.h"

namespace polyest::internal {

inline constexpr int kMinSamplesForNoise = 10;

// Returns the initial noise: unknown scales are not learned yet, and correlations are as given.
LearnedNoise NoiseToBeginWith(const Problem& problem);

// Whether anything of the problem's noise is learned from the record.
bool LearnsNoise(const Problem& problem);

// Returns the revised noise, or nullopt when the present noise needs no revision.
std::optional<LearnedNoise> ReviseNoise(const ResolvedProblem& problem,
                                        const RegionalExpansion& expansion,
                                        const RecordSummary& record, const Stop& stop);

// Returns the bias correction for the lag-1 correlation of N residuals of which a fit has used up
// `share` degrees of freedom. The fit makes the correlation too small by share/N. The sums do not
// distinguish the last sample, which makes it too large by ½/N.
inline double Lag1Correction(double share, double samples) { return (share - 0.5) / samples; }

// Returns Σ λ/(1 + λ), the number of parameters that the data have fitted, 0 … n.
// `mismatch_hessian` is in germ coordinates.
double FittedParameters(const ConstMatrixRef& mismatch_hessian, const Prior& prior);

}  // namespace polyest::internal
