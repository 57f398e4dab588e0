#pragma once

// Standard deviations and covariance of the parameters, from the curvature of the cost at its
// minimum; and how much of the contraction from prior to posterior is due to the data.

#include "core/bayes/prior.h"
#include "core/common/types.h"
#include "core/estimator/posterior/posterior_draws.h"

namespace polyest::internal {

// The minimum of the cost and its second derivatives there, by germ coordinates.
struct MinimumCurvature {
  Vector xi;           // the minimum
  Matrix hessian;      // of the cost, n × n
  Matrix information;  // of the data alone, n × n
};

// Factors by which what the cost says is made wider.
struct SpreadWidening {
  double shift = 1;     // for the error of the expansion
  Vector all;           // by parameter: for all that is known, that error included
  Vector robust_ratio;  // RobustCovariance::ratio
};

// Whether the draws' standard deviation, which is `ratio` times the curvature's, contradicts it.
inline bool Contradicts(double ratio) { return ratio >= 2 || ratio <= 0.5; }

struct ParameterSpread {
  Vector deviation;         // standard deviations of θ, never above the prior's
  Vector robust_deviation;  // as `deviation`, from the scores of windows; 0 if unknown
  Matrix covariance;        // of θ, with the variances deviation²
  Vector informed;          // contractions that are due to the data, from which verdicts are taken
  Vector contraction;       // posterior ÷ prior standard deviation by the curvature, not widened
  // By parameter, where the draws' standard deviation replaces the curvature's: draws' ÷
  // curvature's, else 0; empty if no draws were given.
  Vector drawn_to_curvature;
};

// Returns the spread. A standard deviation is scaled by the slope of the parameter's map at the
// minimum. A parameter with a curved map that the data do not identify is given the prior's own
// standard deviation instead, wherever the minimum lies. `draws`, if not null, are of a posterior
// that nothing speaks against: their standard deviations replace those that they contradict.
ParameterSpread SpreadOfParameters(const MinimumCurvature& minimum, const Prior& prior,
                                   const SpreadWidening& widening, const PosteriorDraws* draws);

// Widens the draws by `factors` of at least 1, where residuals or windows contradict them. A
// widened interval becomes also at least as wide as the curvature's Gaussian, whose standard
// deviations relative to the prior's are `contraction`: of two contradicting spreads the wider one
// counts.
void WidenContradicted(const Vector& factors, const Vector& contraction, const Prior& prior,
                       PosteriorDraws& draws);

}  // namespace polyest::internal
