#pragma once

// Draws of the posterior density ∝ e^{−J} by Markov chains that start from particles of it: groups
// of particles, each moved by differences within its own group alone (differential_evolution.h).
// A particle's path is a chain. They go on until the draws of every quantity are worth as many
// independent ones as asked for, or until they have been moved often enough.

#include <absl/status/statusor.h>

#include "core/bayes/differential_evolution.h"
#include "core/common/stop.h"

namespace polyest {

struct ChainOptions {
  int groups = 4;                  // ≥ 2; that many particles at least
  double effective_size = 20'000;  // asked for, of every quantity
  int most_sweeps = 250;           // moves of every particle, at most
  uint64_t seed = 1;               // the draws are a function of the arguments alone
};

struct Chains {
  // Time after time, draws × n and draws: rows t C … t C + C − 1 are the C particles at time t.
  Matrix etas;
  Vector costs;
  // Of each quantity (convergence.h).
  Vector r_hat;
  Vector effective_size;
};

// quantities (any number × n): the linear functions of η whose convergence is watched. particles:
// at least 8 of each group; what is left over when they are dealt into groups is dropped. lower,
// upper as in SamplePosterior. Not OK only on a stop request.
absl::StatusOr<Chains> RunChains(const Cost& cost, const Vector& lower, const Vector& upper,
                                 const Particles& particles, const Matrix& quantities,
                                 const ChainOptions& options, const Stop& stop);

}  // namespace polyest
