#pragma once

// Particles of the posterior density ∝ e^{−J} on an expansion (23), by sequential Monte Carlo.
//
// The density is tempered, ∝ e^{−βJ} with β rising from 0 to 1; a step of β is as large as halves
// the effective size 1/Σ w² of the particles, which are then resampled and moved by differential
// evolution (differential_evolution.h). Cold starts and single Gaussians miss what tempering finds:
// narrow valleys, bounds, separate pieces.

#include <absl/status/statusor.h>

#include <cstdint>

#include "core/bayes/cost.h"
#include "core/bayes/differential_evolution.h"
#include "core/common/stop.h"
#include "core/common/types.h"

namespace polyest {

struct SamplerOptions {
  int particles = 1000;
  int sweeps = 10;        // of moves after each tempering step
  int final_sweeps = 40;  // at β = 1, at least
  // In all, made up at β = 1: the same work however many steps the tempering takes, up to where
  // sweeps × steps + final_sweeps passes it.
  int total_sweeps = 0;
  uint64_t seed = 1;  // the particles are a function of the arguments alone
};

// lower, upper: the box (n) in local coordinates that particles must not leave; the cost must be
// finite somewhere in it. guesses (any number × n, may be none) are where the posterior was before;
// they and a low-discrepancy cover of the box are where tempering starts.
// FAILED_PRECONDITION when fewer than 50 starting points have a finite cost.
absl::StatusOr<Particles> SamplePosterior(const Cost& cost, const Vector& lower,
                                          const Vector& upper, const Matrix& guesses,
                                          const SamplerOptions& options, const Stop& stop);

}  // namespace polyest
