#pragma once

// Draws from a cover of the expansion's box, weighted by the density. In few dimensions it serves
// where the posterior fills a part of the box that is not too small, whatever its shape: cut off by
// the bounds of an element, curved, or with several modes.

#include <optional>

#include "core/bayes/cost.h"
#include "core/bayes/importance.h"
#include "core/estimator/expansion/expansion_design.h"

namespace polyest::internal {

// Returns the draws if their effective number is at least `effective_size` with `points` points or
// up to twice as many, else nothing; nothing in more than three dimensions.
std::optional<WeightedDraws> DrawFromCover(const Cost& cost, const ExpansionDesign& design,
                                           int points, double effective_size);

}  // namespace polyest::internal
