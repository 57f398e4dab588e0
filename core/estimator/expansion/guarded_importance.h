#pragma once

// Importance sampling from the curvature's Gaussian (bayes/importance.h) where the posterior is
// nearly Gaussian, which is established first. It is used only if all of these hold:
// - There is one minimum, searched from starts spread over the best points of a cover of the box
//   and of the guesses. Other minima have a negligible e^{−J}.
// - It lies inside Ω and the box, the Hessian there is positive definite and the gradient
//   vanishes: Newton's decrement gᵀH⁻¹g/2 is below 10⁻³.
// - No probable point of the cover or of the guesses lies outside the reach of the Gaussian.
// - The effective size is at least half the number of points, and no weight exceeds 1 % of the
//   total.

#include <optional>
#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/importance.h"
#include "core/bayes/minimizer.h"
#include "core/estimator/expansion/expansion_design.h"
#include "polyest/stop.h"

namespace polyest::internal {

struct GuardedDraws {
  std::vector<Minimum> minima;         // distinct, local coordinates, lowest first; may be none
  std::optional<WeightedDraws> draws;  // only if the posterior is nearly Gaussian
};

// Draws `points` ≥ 100 points, if the posterior is nearly Gaussian. `guesses` (any number × n,
// local coordinates) tells where the posterior was before. On a stop request the result is
// incomplete.
GuardedDraws DrawIfNearlyGaussian(const Cost& cost, const ExpansionDesign& design,
                                  const Matrix& guesses, int points, const Stop& stop);

}  // namespace polyest::internal
