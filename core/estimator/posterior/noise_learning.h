#pragma once

// Learning the noise from the residuals at the minimum of the cost on the present expansion: its
// scale where that is unknown, the time constant of its correlation, and where to look for outliers
// from. The answer is what to weigh the record with next; taking the sums anew with it changes the
// minimum, so that the caller repeats until nothing is left to revise.
//
//   scale        s² ← s² (χ² − D)/(N − D − p), D what the expansion's own error takes of χ², p the
//                channel's share of the parameters fitted, Σ λ/(1 + λ) over all; within a factor 4
//                of s² at a time downwards, 16 upwards
//   correlation  a ← a + 0.6 (x − a) for a = exp(−Δt/τ) at the mean interval Δt, x the correlation
//                behind the lag-1 correlation r that the whitened residuals still have (freed of
//                its bias), r = (x − a)(1 − a x)/(1 − 2 a x + a²), while x − a is significant;
//                from white noise a ← r
//
// A scale is not learned before there are kMinSamplesForNoise + 4 n samples, nor a correlation.

#include <absl/status/statusor.h>

#include <optional>

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/record/record_summary.h"
#include "polyest/stop.h"

namespace polyest::internal {

inline constexpr int kMinSamplesForNoise = 10;

// A noise to begin with: unknown scales are not learned, correlations those given.
LearnedNoise NoiseToBeginWith(const Problem& problem);

// Whether anything of the problem's noise is learned from the record.
bool LearnsNoise(const Problem& problem);

// nullopt when the present noise will do.
std::optional<LearnedNoise> ReviseNoise(const ResolvedProblem& problem,
                                        const RegionalExpansion& expansion,
                                        const RecordSummary& record, const Stop& stop);

// What to add to the lag-1 correlation of N residuals, of which a fit has used up `share`: the fit
// makes it too small by share/N; that the sums do not know which sample is the last, too large by
// ½/N.
inline double Lag1Correction(double share, double samples) { return (share - 0.5) / samples; }

// Σ λ/(1 + λ): how many parameters the data have fitted, 0 … n. mismatch_hessian: in the germ.
double FittedParameters(const ConstMatrixRef& mismatch_hessian, const Prior& prior);

}  // namespace polyest::internal
