#pragma once

// Draws of the posterior on an expansion, as few model-free evaluations as an honest answer takes:
// importance sampling from the curvature's Gaussian where the posterior is nearly that
// (bayes/importance.h), Markov chains from tempered particles everywhere else
// (bayes/posterior.h, bayes/markov_chains.h).
//
// Importance sampling is taken only if all of these hold:
// - one minimum, found from starts spread over the best of a cover of the box and of the guesses;
//   other minima have e^{−J} too small to matter;
// - it lies inside of Ω and of the box, the Hessian there is positive definite and the gradient
//   vanishes: Newton's decrement gᵀH⁻¹g/2 is below 10⁻³;
// - no point of the cover and no guess that is probable lies where the Gaussian has nothing;
// - the effective size is at least half of the points, and no weight is above 1 % of all.

#include <absl/status/statusor.h>

#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/minimizer.h"
#include "core/estimator/expansion/expansion_design.h"
#include "polyest/posterior.h"
#include "polyest/stop.h"

namespace polyest::internal {

// How much work draws are worth.
struct PosteriorEffort {
  int importance_points = 16'384;        // ≥ 100
  double chain_effective_size = 30'000;  // asked for, of every parameter
  int max_sweeps = 300;                  // of the chains
};

struct PosteriorDraws {
  PosteriorMethod method = PosteriorMethod::kMarkovChains;
  Matrix scores;   // draws × n: z of the uncertain parameters
  Vector weights;  // Σ = 1
  // Of each parameter: independent draws that would do as well. Importance sampling: 1/Σ w².
  Vector effective_size;
  Vector r_hat;                 // of each parameter's chains; empty for importance sampling
  std::vector<Minimum> minima;  // distinct, local coordinates, lowest first; at least one

  Vector Parameter(const Prior& prior, int i) const;  // the draws of θ_i
};

// guesses (any number × n, may be none; germ coordinates): where the posterior was before.
// FAILED_PRECONDITION when the cost is nowhere finite; else only a stop request makes it not OK.
absl::StatusOr<PosteriorDraws> DrawPosterior(const Cost& cost, const ExpansionDesign& design,
                                             const Matrix& guesses, const PosteriorEffort& effort,
                                             const Stop& stop);

}  // namespace polyest::internal
