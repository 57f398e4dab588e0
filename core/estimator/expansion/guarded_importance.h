#pragma once

// Importance sampling where the posterior is nearly Gaussian or a mixture of such modes, which is
// established first.
//
// Sampling from the curvature's Gaussian (bayes/importance.h) is used only if all of these hold:
// - There is one minimum, searched from starts spread over the best points of a cover of the box
//   and of the guesses. Other minima have a negligible e^{−J}.
// - It lies inside Ω and the box, the Hessian there is positive definite and the gradient
//   vanishes: Newton's decrement gᵀH⁻¹g/2 is below 10⁻³.
// - No probable point of the cover or of the guesses lies outside the reach of the Gaussian.
// - The effective size is at least half the number of points, and no weight exceeds 1 % of the
//   total.
// Where there are several minima in more than three dimensions, others are searched from more
// points of the cover until none is found any more, and the sampling is from a mixture of Gaussians
// at all of them (bayes/mixture_importance.h). Tempering would deal its particles to the modes by
// chance once they are apart. The same conditions hold for each minimum, and for the mixture's
// reach, beyond which one in a hundred of the guesses may lie. In fewer dimensions covers and
// elements find the modes. From four times as many points the draws must have the same effective
// size, and the shape of their weights' tail must be at most 0.7 (bayes/pareto_tail.h). As long as
// they do not, the mixture is adapted to them, up to five times.

#include <cstdint>
#include <optional>
#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/differential_evolution.h"
#include "core/bayes/importance.h"
#include "core/bayes/minimizer.h"
#include "core/estimator/expansion/expansion_design.h"
#include "polyest/stop.h"

namespace polyest::internal {

struct GuardedDraws {
  std::vector<Minimum> minima;         // distinct, local coordinates, lowest first; may be none
  std::optional<WeightedDraws> draws;  // only if they can be trusted
  // Draws in the modes' shares that are good enough for Markov chains to start from, though not to
  // be trusted in each mode's tails; only where there are several minima and no `draws`.
  std::optional<WeightedDraws> rough;
};

// Draws `points` ≥ 100 points, four times as many from several Gaussians, if they can be trusted.
// `guesses` (any number × n, local coordinates) tells where the posterior was before. On a stop
// request the result is incomplete.
GuardedDraws DrawIfNearlyGaussian(const Cost& cost, const ExpansionDesign& design,
                                  const Matrix& guesses, int points, const Stop& stop);

// Resamples `count` equally weighted particles, each draw as often as its weight says, and shuffles
// them: the first particles become check points, and the order of quasi-random points is anything
// but random.
Particles Resampled(const WeightedDraws& draws, int count, uint64_t seed);

}  // namespace polyest::internal
