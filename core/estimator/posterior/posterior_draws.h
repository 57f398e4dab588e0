#pragma once

// Draws of the posterior on an expansion, with as few evaluations as a reliable result needs.
// Importance sampling from the curvature's Gaussian, or from one at each of several minima, is used
// where that approximates the posterior (expansion/guarded_importance.h). Elsewhere Markov chains
// (bayes/markov_chains.h) are started from its draws if they are good enough for that, or else from
// tempered particles (bayes/posterior.h).

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/minimizer.h"
#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/problem/resolved_problem.h"
#include "polyest/posterior.h"
#include "polyest/stop.h"

namespace polyest::internal {

// The computing effort to spend on draws.
struct PosteriorEffort {
  int importance_points = 16'384;        // ≥ 100
  double chain_effective_size = 30'000;  // target for every parameter
  int max_sweeps = 300;                  // maximum for the chains
  bool evidence = false;                 // whether the model's evidence is wanted, too
};

// Returns the effort for an estimate. Fewer points suffice for fewer parameters, because points of
// low discrepancy cover few dimensions more evenly, unless the noise is unknown: the posterior over
// a short record then has the tails of a Student's t.
PosteriorEffort EffortForEstimate(const ResolvedProblem& problem);

struct PosteriorDraws {
  PosteriorMethod method = PosteriorMethod::kMarkovChains;
  Matrix scores;   // draws × n, scores z of the uncertain parameters
  Vector weights;  // Σ = 1
  // Number of independent draws of the same accuracy, per parameter. For importance sampling: 1/Σ
  // w².
  Vector effective_size;
  // The group of Markov chains of each draw; empty for importance sampling.
  Eigen::VectorXi chain;
  Vector r_hat;  // per parameter, over its chains; empty for importance sampling
  // Distinct, local coordinates, at least one: lowest first, but for the one that an assessment may
  // put before lower ones (believed_minimum.h).
  std::vector<Minimum> minima;

  Vector Parameter(const Prior& prior, int i) const;  // returns the draws of θ_i
  Matrix Germs(const Prior& prior) const;             // returns the draws of ξ, draws × n
};

// Returns why the Markov chains cannot be trusted, by the criteria of Vehtari et al.
// (bayes/convergence.h); empty if they can, and for importance sampling.
std::string WhyNotMixed(const PosteriorDraws& draws);

// Multiplies the weights by factors whose logarithms are given, up to a common constant.
void Reweigh(const ConstVectorRef& log_factors, PosteriorDraws& draws);

// Widens the draws' scores about their mean by a factor for each parameter, but not beyond Ω, and
// to no larger standard deviation than the prior's.
void Widen(const Vector& factors, const Prior& prior, PosteriorDraws& draws);

// Draws from the posterior. `guesses` (any number × n, may be empty; germ coordinates) tells where
// the posterior was before. Returns InfeasibleError when the cost is nowhere finite; otherwise
// only a stop request returns an error.
absl::StatusOr<PosteriorDraws> DrawPosterior(const Cost& cost, const ExpansionDesign& design,
                                             const Matrix& guesses, const PosteriorEffort& effort,
                                             const Stop& stop);

}  // namespace polyest::internal
