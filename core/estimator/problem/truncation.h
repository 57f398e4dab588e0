#pragma once

// Truncations that follow from the options of an expansion (polyest/expansion_options.h).

#include <optional>

#include "core/chaos/multi_index.h"
#include "polyest/expansion_options.h"

namespace polyest::internal {

// Returns the initial truncation of an expansion in n uncertain parameters.
Truncation FirstTruncation(const ExpansionOptions& options, int dimension);
// Returns a truncation that is two orders higher, or one if two are too expensive. Returns nothing
// when the order is given, or when more is too expensive: beyond order 9, or 500 terms, or 1,001
// at order 4. Past order 9, two points per term no longer determine the terms well.
std::optional<Truncation> NextTruncation(const ExpansionOptions& options, int dimension,
                                         const Truncation& present);

}  // namespace polyest::internal
