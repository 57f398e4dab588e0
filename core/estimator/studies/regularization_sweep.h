#pragma once

// The minima of the cost over the regularization weight α² of (56), Figure 14 of the paper, and the
// α² that the rules of bayes/regularization.h and bayes/l_curve.h choose
// (polyest/regularization.h).

#include <absl/status/statusor.h>

#include "core/bayes/regularization.h"
#include "core/estimator/posterior/assessment.h"
#include "polyest/regularization.h"

namespace polyest::internal {

// options have been validated; `assessed` is the assessment on the expansion. Only a stop request
// makes it not OK.
absl::StatusOr<RegularizationSweep> SweepRegularization(const ResolvedProblem& problem,
                                                        const RegionalExpansion& expansion,
                                                        const Assessed& assessed,
                                                        const RegularizationOptions& options,
                                                        const Stop& stop);

}  // namespace polyest::internal
