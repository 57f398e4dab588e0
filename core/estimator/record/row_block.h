#pragma once

// Puts rows of one block behind those of another.

#include <cstdint>

#include "polyest/samples.h"

namespace polyest::internal {

// Appends rows [first, first + count) of `from`, which must be there, to `to`, which has the same
// columns or no rows. Leaves `run_ended` of `to` as it is.
void AppendRows(const RowBlock& from, int64_t first, int64_t count, RowBlock& to);
// Removes all rows; keeps their memory.
void ClearRows(RowBlock& block);

}  // namespace polyest::internal
