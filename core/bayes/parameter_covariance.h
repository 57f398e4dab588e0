#pragma once

// The covariance of θ = t(z) for Gaussian scores z ~ N(ẑ, C), without a linearization of t. It maps
// the Gaussian that the curvature gives in the germs to the parameters.
//
// With s_i² = C_ii, r_ij = C_ij/(s_i s_j) and the orthonormal Hermite polynomials h_k, expand each
// parameter, t_i(ẑ_i + s_i u) = Σ_k c_ik h_k(u). Then by Mehler's formula
//   cov(θ_i, θ_j) = Σ_{k≥1} r_ij^k c_ik c_jk,
// which is positive semidefinite wherever the sum ends. Affine: c_i1 = scale s_i alone, the linear
// rule.
// Lognormal and log-uniform: c_ik = e^{location + scale ẑ_i + v/2} v^{k/2}/√k!, v = (scale s_i)².
// v is at most 36, so that the variance is finite; it is far larger than the prior's then. A
// correlated parameter of another family: Gauss's rule of 64 points; its standard deviation is then
// right to 10⁻³ for s_i ≤ 1.
// As s → 0 this is the delta method, t′ C t′; at ẑ = 0, C = P it is the prior's own covariance.

#include "core/bayes/prior.h"
#include "core/common/types.h"

namespace polyest::internal {

// Returns the n × n covariance at z (n), for `root` (n × m) with C = root rootᵀ.
Matrix ParameterCovariance(const Prior& prior, const ConstVectorRef& z, const ConstMatrixRef& root);

// Returns the prior's own covariance of θ (n × n), with the exact variances of the marginals.
Matrix PriorCovariance(const Prior& prior);

}  // namespace polyest::internal
