#pragma once

// Finds the row of a batch that the daemon refuses, and names it as a row of the whole data.

#include <absl/status/status.h>

#include <cstdint>
#include <optional>

namespace polyest::internal {

// Returns the row, from 0, of the measurements or of the record to predict that a status refuses;
// nothing if it refuses something else.
std::optional<int> RefusedRow(const absl::Status& status);

// Returns the refusal of a row of a batch as that of a row of the data, which has so many rows
// before the batch. Any other status stays as it is.
absl::Status AtRowOfData(const absl::Status& status, int64_t rows_before);

}  // namespace polyest::internal
