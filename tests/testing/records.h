#pragma once

// Reads records of real hardware, which may lie beside the repository in ../shared/data. Tests that
// need them skip with a message if they do not.

#include <optional>
#include <string>
#include <vector>

#include "polyest/estimator.h"

namespace polyest::internal::testing {

// Returns the record in a file: the first column is the time, the next ones get the names in
// `columns`. Returns nothing when the file does not exist.
std::optional<Samples> SharedRecord(const std::string& file,
                                    const std::vector<std::string>& columns);

// Returns the rows [first, first + count) of a record; fewer at its end.
Samples Rows(const Samples& record, size_t first, size_t count);

// Appends and processes a record in batches and returns the estimate. An error ends the program:
// tests with invalid input check the status themselves.
Estimate EstimateInBatches(const Problem& problem, const Samples& record, size_t batch_rows,
                           int threads = 1);

}  // namespace polyest::internal::testing
