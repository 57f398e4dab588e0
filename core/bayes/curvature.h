#pragma once

// Uncertainty from the curvature of the cost: the covariance is the inverse of the Hessian at the
// minimum. In coordinates s scaled to unit prior standard deviation, H_s = V Λ Vᵀ; along an
// eigenvector the variance is 1/Λ_i, but never more than 1, the prior's: where the curvature gives
// a larger variance (flat, wide or concave) the prior's is kept. The result is a Gaussian in the
// germs; parameter_covariance.h maps it to the parameters, so that without data it is the prior's
// covariance for any map.

#include "core/bayes/prior.h"
#include "core/common/types.h"

namespace polyest::internal {

struct Curvature {
  Matrix covariance;              // of θ, n × n
  Vector standard_deviation;      // of θ
  Vector contraction;             // of the scores z: standard deviation ÷ the prior's, ≤ 1
  bool limited_by_prior = false;  // in at least one direction
};

// Returns the covariance for `hessian`, the symmetric n × n Hessian of J with respect to the germ
// at `xi`.
Curvature CovarianceFromCurvature(const ConstMatrixRef& hessian, const Prior& prior,
                                  const ConstVectorRef& xi);

}  // namespace polyest::internal
