#pragma once

#include <cstdint>

#include "polyest/problem.h"

namespace polyest::internal {

// Returns a checksum of the whole problem: the names, units, defaults and equations of its model,
// all priors, inputs with their knots, measured outputs with their noise, and options. Two problems
// with the same fingerprint give bit-identical results, except for a coincidence of probability 1
// in 4·10⁹.
uint32_t FingerprintOf(const Problem& problem);

}  // namespace polyest::internal
