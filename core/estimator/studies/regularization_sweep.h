#pragma once

// The minima of the cost as a function of the regularization weight α² of (56) (Figure 14 of the
// paper), and the α² that the rules of bayes/regularization.h and bayes/l_curve.h choose
// (polyest/regularization.h).

#include <absl/status/statusor.h>

#include "core/bayes/regularization.h"
#include "core/estimator/posterior/assessment.h"
#include "polyest/regularization.h"

namespace polyest::internal {

// Computes the sweep. `options` must be valid, and `assessed` the assessment on the expansion.
// Returns an error only on a stop request.
absl::StatusOr<RegularizationSweep> SweepRegularization(const ResolvedProblem& problem,
                                                        const RegionalExpansion& expansion,
                                                        const Assessed& assessed,
                                                        const RegularizationOptions& options,
                                                        const Stop& stop);

}  // namespace polyest::internal
