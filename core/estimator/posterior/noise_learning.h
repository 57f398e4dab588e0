#pragma once

// Learns the noise from the residuals at the minimum of the cost on the present expansion: its
// scale if unknown, its correlation, and the point at which outliers are
// judged. The result is the noise with which to weigh the record next. Taking the sums again with
// it changes the minimum, so the caller repeats this until nothing is left to revise.
//
//   scale        s² ← s² (χ² − D)/(N − D − p). D is the expansion's own share of χ², and p the
//                channel's share of the number of fitted parameters Σ λ/(1 + λ). In one revision
//                s² falls at most by a factor 4 and rises at most by a factor 16.
//   correlation  τ and the white share f ← the most probable of white noise and a grid of time
//                constants from a quarter of the least sampling interval to the record's length,
//                without a white share and with some, by the likelihood over the actual intervals
//                with the parameters following (correlation_profile.h, noise_choice.h). An unknown
//                scale is revised together with them. The parameters follow linearly about a point
//                that moves to the minimum where the model is curved. Where outliers are handled,
//                a ← a + 0.6 (x − a) for a = exp(−Δt/τ) at the mean interval instead; x explains
//                the lag-1 correlation r that is left, r = (x − a)(1 − a x)/(1 − 2 a x + a²).
//
// Neither is learned before the channel has MinSamplesForNoise samples.

#include <absl/status/statusor.h>

#include <optional>

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/record/record_summary.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns the number of samples of a channel from which its noise is learned, for n unknowns. The
// likelihood with the scale integrated out has (N − n)/2 degrees of freedom; with 4 to spare the
// scale may still collapse onto a chance fit, with 6 it does not.
inline int64_t MinSamplesForNoise(int64_t n) { return n + 6; }
// Returns it for all unknowns of the record so far, with those of ended runs, which the samples had
// to tell as well.
int64_t MinSamplesForNoise(const ResolvedProblem& problem);

// Returns the scale of a channel whose scale is not learned yet that its next sample asks for, or
// nullopt if the present one stays. The scale is twice the largest |z| so far; `value` is |z| of
// the next sample. Samples of 0 have no size: before there is another, `predicted`, the size of the
// predictions, takes its place. Both are in units of the noise that the problem gives.
std::optional<double> UnlearnedScale(const RecordSummary& record, size_t channel, double value,
                                     double predicted, double present);

// Whether anything of the problem's noise is learned from the record.
bool LearnsNoise(const Problem& problem);
// Whether a channel has outliers, whose weights are taken at the minimum of the cost.
bool HandlesOutliers(const Problem& problem);

// Returns the revised noise, or nullopt when the present noise needs no revision. The minimum is
// searched from the expansion's reference or the posterior known, and from the best of `particles`
// (any number × n, germ coordinates).
std::optional<LearnedNoise> ReviseNoise(const ResolvedProblem& problem,
                                        const RegionalExpansion& expansion,
                                        const RecordSummary& record, const Matrix& particles,
                                        const Stop& stop);

// Returns Σ λ/(1 + λ), the number of parameters that the data have fitted, 0 … n.
// `mismatch_hessian` is in germ coordinates.
double FittedParameters(const ConstMatrixRef& mismatch_hessian, const Prior& prior);

}  // namespace polyest::internal
