#pragma once

// Identifiability: the data's information compared with the prior's. The eigenvalues λ of the
// prior-preconditioned mismatch Hessian, Lᵀ H_mismatch L with L Lᵀ = prior covariance, are the
// data's information in the directions of the eigenvectors, in units of the prior's.
//
// A parameter's verdict compares the posterior of its score z with its prior marginal. A parameter
// on which the data say nothing is therefore IDENTIFIED if it is correlated a priori with one that
// they identify: its value is then known because of that correlation. The directions show the
// difference: they count the data's information alone.

#include <vector>

#include "core/bayes/prior.h"
#include "core/common/types.h"
#include "polyest/estimate.h"

namespace polyest::internal {

// A direction is IDENTIFIED if the data's information is ten times the prior's, NOT_IDENTIFIED if
// it is less than the prior's, and WEAK in between.
inline constexpr double kIdentifiedInformation = 10;
inline constexpr double kWeakInformation = 1;
// The limits of contraction = posterior ÷ prior standard deviation for a parameter's verdict.
inline constexpr double kIdentifiedContraction = 0.5;
inline constexpr double kNotIdentifiedContraction = 0.9;

// Returns the directions, most informed first, each with the sign that makes its largest
// coefficient positive. `mismatch_hessian` is with respect to the germ ξ.
std::vector<Direction> Directions(const ConstMatrixRef& mismatch_hessian, const Prior& prior);

Verdict VerdictOfContraction(double contraction);

}  // namespace polyest::internal
