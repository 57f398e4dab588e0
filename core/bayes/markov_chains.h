#pragma once

// Draws of the posterior density ∝ e^{−J} by Markov chains that start from particles of it. Each
// particle's path is a chain, moved by differences within its own group of particles alone
// (differential_evolution.h). The chains end when the draws of every quantity have the effective
// size asked for, or after `max_sweeps`.

#include <absl/status/statusor.h>

#include "core/bayes/differential_evolution.h"
#include "polyest/stop.h"

namespace polyest::internal {

struct ChainOptions {
  int groups = 4;                  // ≥ 2
  double effective_size = 20'000;  // asked for every quantity
  int max_sweeps = 250;            // greatest number of moves of each particle
  uint64_t seed = 1;               // the draws depend on the arguments alone
};

struct Chains {
  // The draws (draws × n), ordered by time: rows t C … t C + C − 1 are the C particles at time t.
  Matrix etas;
  Vector costs;
  // The group of each draw, 0 … groups − 1. Groups never exchange anything.
  Eigen::VectorXi group;
  // The diagnostics, one entry per quantity (convergence.h).
  Vector r_hat;
  Vector effective_size;
};

// Runs chains from `particles`, at least 8 for each group; a remainder that does not fill the
// groups is dropped. `quantities` (any number × n) are the linear functions of η whose convergence
// is watched; `lower` and `upper` are as in SamplePosterior. Fails on a stop request only.
absl::StatusOr<Chains> RunChains(const Cost& cost, const Vector& lower, const Vector& upper,
                                 const Particles& particles, const Matrix& quantities,
                                 const ChainOptions& options, const Stop& stop);

}  // namespace polyest::internal
