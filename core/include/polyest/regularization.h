#pragma once

// The minima of the cost J_mismatch + α² J_apriori for several regularization weights α², and the
// α² that the rules of RegularizationMode choose. Estimator::CurrentRegularizationSweep computes
// them all on one expansion, where the posterior of α² = 1 is. An α² that pulls the minimum out of
// the region in which the expansion is trusted has no point, and the rules leave it out. (A fixed
// expansion, ExpansionOptions::adaptive = false, reaches farther and is less exact.)

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "polyest/diagnostic.h"
#include "polyest/estimate.h"
#include "polyest/types.h"

namespace polyest {

// The most values of α² that a sweep may have.
inline constexpr int kMaxRegularizations = 1'001;

// What to compute.
struct RegularizationOptions {
  double lowest = 1e-4;  // α², 10⁻⁸ … 10⁸
  double highest = 1e4;  // α², above `lowest`, at most 10⁸
  int points = 33;       // values even in log α², 2 … kMaxRegularizations

  // Returns OK, or INVALID_ARGUMENT with the field, the value and the rule.
  absl::Status Validate() const;
};

// The minimum for one α².
struct RegularizationPoint {
  double regularization = 1;        // α²
  CostValue cost;                   // at the minimum
  double effective_parameters = 0;  // number of parameters that the data fit, 0 … n
  double log_evidence = 0;          // log p(data | α²) less the largest of all points
  Vector map;                       // the parameters at the minimum, n
  Vector std_dev;                   // from the curvature there, at most the prior's, n
  bool converged = true;            // whether the minimizer converged
};

// What a rule says of α².
struct RegularizationChoice {
  bool determined = false;    // whether the rule chooses one
  double regularization = 1;  // α²; 1 where it is not determined
  std::string reason;         // why the rule chooses none; empty if it does
};

// The minima over α².
struct RegularizationSweep {
  std::vector<std::string> parameters, units;           // of the uncertain parameters, n each
  std::vector<RegularizationPoint> points;              // α² increasing
  RegularizationChoice l_curve, discrepancy, evidence;  // what each rule chooses
  double regularization = 1;                            // α² of the estimate
  std::vector<Diagnostic> diagnostics;                  // those of the estimate
};

}  // namespace polyest
