#pragma once

// Lets expansions absorb rows of the record, block by block.

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>

#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// Makes an expansion of the design and lets it absorb the first `rows` rows of the store, from
// problem.first_row() on. Returns InfeasibleError when its collocation matrix cannot be factored
// or too few trajectories are left.
absl::StatusOr<std::unique_ptr<RegionalExpansion>> Replay(const ResolvedProblem& problem,
                                                          ExpansionDesign design,
                                                          LearnedNoise noise,
                                                          const SampleStore& store, int64_t rows,
                                                          int threads, const Stop& stop);

// Lets the expansion absorb the rows of the store from its next one to before the row `end`.
// Returns InfeasibleError when too few trajectories are left.
absl::Status TakeRows(const SampleStore& store, int64_t end, const Stop& stop,
                      RegionalExpansion& expansion);

}  // namespace polyest::internal
