#pragma once

// Records of real hardware that may lie beside the repository, in ../shared/data; a test skips,
// saying so, when they do not.

#include <optional>
#include <string>
#include <vector>

#include "polyest/estimator.h"

namespace polyest::internal::testing {

// The named columns after the first, which is the time; nothing when the file is not there.
std::optional<Samples> SharedRecord(const std::string& file,
                                    const std::vector<std::string>& columns);

// Rows [first, first + count) of a record, fewer at its end.
Samples Rows(const Samples& record, size_t first, size_t count);

// Appends and processes a record in batches and estimates; a failing status ends the program, for
// a test that gives bad input looks at the status itself.
Estimate EstimateInBatches(const Problem& problem, const Samples& record, size_t batch_rows,
                           int threads = 1);

}  // namespace polyest::internal::testing
