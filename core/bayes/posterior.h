#pragma once

// Particles of the posterior density ∝ e^{−J} on an expansion (23), by sequential Monte Carlo.
//
// The density is tempered, ∝ e^{−βJ}, with β rising from 0 to 1. Each step of β halves the
// effective size 1/Σ w² of the particles, which are then resampled and moved by differential
// evolution (differential_evolution.h). Tempering finds what cold starts and single Gaussians miss:
// narrow valleys, bounds, separate modes.

#include <absl/status/statusor.h>

#include <cstdint>

#include "core/bayes/cost.h"
#include "core/bayes/differential_evolution.h"
#include "core/common/types.h"
#include "polyest/stop.h"

namespace polyest::internal {

struct SamplerOptions {
  int particles = 1000;
  int sweeps = 10;        // moves of each particle after a tempering step
  int final_sweeps = 40;  // moves at β = 1, at least
  // The least number of sweeps in all. More are added at β = 1 until it is reached, so that the
  // work does not depend on the number of tempering steps unless sweeps × steps + final_sweeps
  // exceeds it.
  int total_sweeps = 0;
  uint64_t seed = 1;  // the particles depend on the arguments alone
};

// Returns particles of the posterior. `lower` and `upper` (n) bound the box in local coordinates
// that particles must not leave; the cost must be finite somewhere in it. `guesses` (any number ×
// n, may be none) are particles of an earlier posterior; tempering starts from them and from a
// low-discrepancy cover of the box's part in Ω (domain_cover.h). Returns InfeasibleError if
// fewer than 50 starting points have a finite cost.
absl::StatusOr<Particles> SamplePosterior(const Cost& cost, const Vector& lower,
                                          const Vector& upper, const Matrix& guesses,
                                          const SamplerOptions& options, const Stop& stop);

}  // namespace polyest::internal
