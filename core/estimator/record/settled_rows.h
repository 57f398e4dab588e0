#pragma once

// How far the streamed inputs of a record are determined, whatever rows may follow.

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/samples.h"

namespace polyest::internal {

// The last rows of the present run that have a sample of a streamed input.
struct KnotRows {
  static constexpr size_t kMaxNeeded = 4;  // of InputSignal::knots_needed

  int64_t count = 0;
  std::array<int64_t, kMaxNeeded> last = {};  // the latest first

  void Add(int64_t row);
};

// Returns the number of rows for which the streamed inputs are settled as far as their samples need
// them, of a store of `rows` rows whose present run began with row `run_begin` and goes on.
// `knots`: by streamed input. Returns the store's errors.
absl::StatusOr<int64_t> SettledRows(const ResolvedProblem& problem,
                                    const std::vector<KnotRows>& knots, int64_t run_begin,
                                    int64_t rows, const SampleStore& store);

}  // namespace polyest::internal
