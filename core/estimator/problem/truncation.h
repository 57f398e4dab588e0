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

// Returns the number of collocation points of an expansion with so many terms over a region.
double PointCount(const ExpansionOptions& options, double terms);
// Returns that over the whole prior, where a tensor grid may be asked for: (order + 1)ⁿ points.
double PointCountOnPrior(const ExpansionOptions& options, int dimension,
                         const Truncation& truncation, double terms);

}  // namespace polyest::internal
