#pragma once

#include <cstdint>

#include "polyest/problem.h"

namespace polyest::internal {

// A checksum of all that a problem says: of its model the names, units, defaults and equations; all
// priors, inputs with their knots, measured outputs with their noise, and options. Two problems of
// the same fingerprint give, but for an accident of 1 in 4·10⁹, the same bits.
uint32_t FingerprintOf(const Problem& problem);

}  // namespace polyest::internal
