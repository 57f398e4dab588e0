#pragma once

// Uncertainty from the curvature of the cost: the covariance is the inverse of the Hessian at the
// minimum. In coordinates s scaled to unit prior standard deviation, H_s = V Λ Vᵀ; along an
// eigenvector the variance is 1/Λ_i, but never more than the prior's 1: where the curvature knows
// less than the prior (flat, wider or concave) the prior's own is kept.

#include "core/bayes/prior.h"
#include "core/common/types.h"

namespace polyest {

struct Curvature {
  Matrix covariance;              // of θ, n × n
  Vector standard_deviation;      // of θ
  bool limited_by_prior = false;  // in at least one direction
};

// hessian: of J with respect to the germ ξ, n × n, symmetric.
Curvature CovarianceFromCurvature(const ConstMatrixRef& hessian, const Prior& prior);

}  // namespace polyest
