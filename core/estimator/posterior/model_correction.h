#pragma once

// The exact-model correction of the posterior on an expansion. At the check points, which are draws
// of the posterior, ΔJ = J of the model − J of the expansion is known. A polynomial in the
// posterior's standardized coordinates, constant, linear or quadratic, is fitted to it, and every
// draw of the posterior gets the factor e^{−ΔJ} by that polynomial. The degree is the one that
// predicts check points best that it was not fitted to (leave-one-out), so that an expansion that
// is accurate already stays as it is.
//
// Importance weights e^{−ΔJ} of the check points alone would replace the expansion's small error by
// the scatter of a mean over few draws; the polynomial leaves only what it does not explain.

#include <optional>

#include "core/estimator/expansion/model_agreement.h"

namespace polyest::internal {

struct ModelCorrection {
  int degree = 0;      // of the polynomial; 0: no correction
  Vector log_factors;  // −ΔJ of each draw up to a constant; empty for degree 0
  // Bound on the remaining error of a posterior mean, in its standard deviations: the root mean
  // square of what the polynomial leaves of ΔJ at check points that it was not fitted to.
  // Meaningful only if the degree is above 0.
  double shift = 0;
  // Shape of the tail of the check points' importance weights by the model itself
  // (bayes/pareto_tail.h). None for fewer than 25 check points, and none where these no longer
  // represent the posterior on the expansion while the expansion is as good as the model.
  std::optional<double> pareto_shape;
};

// Returns the correction of the posterior that the draws represent: etas (draws × n, local
// coordinates of the expansion) with `weights`, Σ = 1. `checks` are those at the cost that they
// were drawn from, at check points that are draws of a posterior, too. `largest_shift` is that of
// the expansion (model_agreement.h), at the power 1.
ModelCorrection CorrectByModel(const CheckDifferences& checks, const ConstMatrixRef& etas,
                               const ConstVectorRef& weights, double largest_shift);

}  // namespace polyest::internal
