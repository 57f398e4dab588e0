#pragma once

// The minima of the cost over the regularization weight α² of (56), Figure 14 of the paper, and the
// α² that the rules of bayes/regularization.h and bayes/l_curve.h choose.
//
// All on one expansion, where the posterior of α² = 1 is: an α² so large or so small that it pulls
// the minimum out of the region in which the expansion is trusted has no point, nor do the rules
// look at it. (A fixed expansion, "adaptive": false, reaches farther, and is less exact.)

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/bayes/regularization.h"
#include "core/estimator/assessment.h"

namespace polyest {

inline constexpr int kMostRegularizations = 1'001;

struct RegularizationOptions {
  double lowest = 1e-4;  // α², 10⁻⁸ … 10⁸
  double highest = 1e4;  // > lowest, ≤ 10⁸
  int points = 33;       // even in log α², 2 … kMostRegularizations

  // INVALID_ARGUMENT names the field, the value and the rule.
  absl::Status Validate() const;
};

struct RegularizationPoint {
  double regularization = 1;  // α²
  CostValue cost;             // at the minimum for it
  double effective_parameters = 0;
  double log_evidence = 0;  // less that of the largest of the points
  Vector map;               // θ at the minimum, n
  Vector std_dev;           // from the curvature there, at most the prior's, n
  bool converged = true;
};

struct RegularizationSweep {
  std::vector<std::string> parameters, units;
  std::vector<RegularizationPoint> points;  // α² increasing
  RegularizationChoice l_curve, discrepancy, evidence;
  double regularization = 1;            // that of the estimate
  std::vector<Diagnostic> diagnostics;  // those of the estimate
};

// The rule's choice (not FIXED) for an estimate. Only a stop request makes it not OK.
absl::StatusOr<RegularizationChoice> ChooseRegularization(const ResolvedProblem& problem,
                                                          const RegionalExpansion& expansion,
                                                          const Stop& stop);

// options have been validated; `assessed` is the assessment on the expansion. Only a stop request
// makes it not OK.
absl::StatusOr<RegularizationSweep> SweepRegularization(const ResolvedProblem& problem,
                                                        const RegionalExpansion& expansion,
                                                        const Assessed& assessed,
                                                        const RegularizationOptions& options,
                                                        const Stop& stop);

}  // namespace polyest
