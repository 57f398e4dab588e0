#pragma once

// Goes on with an expansion from the state that it keeps, with other scales of the noise or another
// tolerance of the integrators, so that the record need not be propagated again.
//
// Where the scale of a channel's noise becomes s times as large, the variances R = s² σ² + ρ of its
// sums become s² times as large, up to the expansion's own error ρ; so G, b, w and χ² are divided
// by s². Of the error that this leaves, as of that of the sums, carry_over.h says how large it may
// be.
//
// With another tolerance the sums and the states stay as they are. What the integrators' errors do
// to the estimate is what the control trajectories tell, which go on as well.

#include <absl/status/statusor.h>

#include <memory>

#include "core/estimator/expansion/carry_over.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// Returns an expansion like `present`, of the problem with its present tolerance, that has absorbed
// the same `rows` rows with `noise`. Returns InfeasibleError where the sums do not tell what
// they would be: if anything but scales differs, if a scale that differs belongs to noise with
// outliers or is not learned yet, if the correlation of noise is being learned, or if the expansion
// keeps no state or its error might shift the posterior by more than `max_shift` of its standard
// deviations.
absl::StatusOr<std::unique_ptr<RegionalExpansion>> Rescaled(const ResolvedProblem& problem,
                                                            const RegionalExpansion& present,
                                                            LearnedNoise noise,
                                                            const SampleStore& store, int64_t rows,
                                                            int threads, const Stop& stop,
                                                            double max_shift = kMaxCarriedShift);

}  // namespace polyest::internal
