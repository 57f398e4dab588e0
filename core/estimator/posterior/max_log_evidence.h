#pragma once

// A bound for the evidence of a component, found without draws.

#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// Returns an estimate from above of the component's log evidence (mixture_share.h): the volume of
// its box times the greatest density in it, found by minimizing the cost from the best of a cover
// of the box and of the guesses (any number × n, germ coordinates). −∞ if the cost is finite at
// none of these.
double MaxLogEvidence(const RegionalExpansion& expansion, const Cost& cost, const Matrix& guesses);

}  // namespace polyest::internal
