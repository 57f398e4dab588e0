#pragma once

// Eliminates the parameters of runs that have ended (problem/ended_runs.h).
//
// A run is expanded over the region of the shared germs and, about its path, over 4 standard
// deviations of its own germs:
//   ξ_θ = centre + A η_θ,   ξ_φ = path(ξ_θ) + 4 spread η_φ.
// At the collocation points of the shared germs the integrand's minimum and integral are found on
// that expansion (run_marginal.h). The path is the polynomial of the shared terms that fits the
// minima best. If a minimum lies beyond the region, or the spread differs by more than a factor 2,
// the run is expanded again about the path that was found. The expansion's terms along the path,
// Φ_qs = φ_s(η_θq, path(η_θq)), are fitted by the terms of the shared germs, which takes the sums
// over to those: Φ ≈ A_θ T, T is S_θ × S.

#include <absl/status/statusor.h>

#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/expansion/run_path.h"
#include "core/estimator/problem/ended_runs.h"

namespace polyest::internal {

// The rows [first, end) of the record that are a run's.
struct RunRows {
  int run = 0;
  int64_t first = 0, end = 0;
};

struct EliminationRequest {
  const ResolvedProblem* problem = nullptr;  // of any runs
  const SampleStore* store = nullptr;
  int threads = 1;
  LearnedNoise noise;  // its scales are replaced by those of the ended runs
};

// Adds the run, which follows the ended ones in the record, and returns the trajectories × rows
// that it took. `path` is where its own parameters are expected. Returns InfeasibleError when
// the run cannot be expanded there.
absl::StatusOr<int64_t> EliminateRun(const EliminationRequest& request, const RunRows& rows,
                                     const RunPath& path, const Stop& stop, EndedRuns& ended);

}  // namespace polyest::internal
