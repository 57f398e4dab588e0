#pragma once

// What the data say beside the prior. Eigen-decompose the prior-preconditioned mismatch Hessian,
// Lᵀ H_mismatch L with L Lᵀ = prior covariance: an eigenvalue λ is the data's information in that
// direction in units of the prior's.
//
// A parameter's verdict compares the posterior of its score z with its prior marginal. So one on
// which the data are silent is IDENTIFIED all the same when it is correlated a priori with one that
// they know: what is known of it then rests on that correlation, but known it is. The directions
// show the difference: they count the data's information alone.

#include <vector>

#include "core/bayes/prior.h"
#include "core/common/types.h"

namespace polyest {

enum class Verdict { kIdentified, kWeak, kNotIdentified };

struct Direction {
  double information = 0;  // λ ≥ 0 (a negative curvature of the mismatch counts as none)
  // Unit vector over the parameters, each in units of the prior standard deviation of its score.
  // Correlated parameters move together in a direction on which the data are silent for one.
  Vector coefficients;
  Verdict verdict = Verdict::kNotIdentified;
};

// A direction is IDENTIFIED when the data know it ten times better than the prior (in variance),
// NOT_IDENTIFIED when they know less than the prior, WEAK between.
inline constexpr double kIdentifiedInformation = 10;
inline constexpr double kWeakInformation = 1;
// A parameter's verdict by contraction = posterior ÷ prior standard deviation.
inline constexpr double kIdentifiedContraction = 0.5;
inline constexpr double kNotIdentifiedContraction = 0.9;

// mismatch_hessian: with respect to the germ ξ. Most informed first; the sign of a direction is
// such that its largest coefficient is positive.
std::vector<Direction> Directions(const ConstMatrixRef& mismatch_hessian, const Prior& prior);

Verdict VerdictOfContraction(double contraction);

}  // namespace polyest
