#pragma once

// The truncations that follow from options of an expansion (polyest/expansion_options.h).

#include <optional>

#include "core/chaos/multi_index.h"
#include "polyest/expansion_options.h"

namespace polyest::internal {

// Returns the truncation an expansion in n uncertain parameters begins with.
Truncation FirstTruncation(const ExpansionOptions& options, int dimension);
// Returns a truncation of two orders more, or one; nothing when the order is given or more is not
// affordable: past 500 terms or order 9, beyond which two points a term no longer determine the
// terms well.
std::optional<Truncation> NextTruncation(const ExpansionOptions& options, int dimension,
                                         const Truncation& present);

}  // namespace polyest::internal
