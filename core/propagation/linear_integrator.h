#pragma once

// The integrator of linear models: steps without error of integration (exact_step.h), each from one
// sample or knot to the next.
//
// The matrices of a step are kept for the lengths that come again, as those of regular samples do.
// Lengths that agree within the rounding errors of the times are one; the difference is made up by
// the series. A length that has not come before is composed of steps of the lengths 2^k δ, the
// binary digits of h/δ, with the series for the rest; the matrices of these are kept too. Irregular
// samples thus cost products of a matrix and a vector, not of two matrices.

#include <memory>

#include "core/propagation/block_integrator.h"
#include "core/propagation/linear_system.h"

namespace polyest::internal {

// Makes an integrator that starts at `time_s` with `states`. `inputs`, which must stop at every
// knot, must outlive it.
std::unique_ptr<BlockIntegrator> MakeLinearIntegrator(LinearSystem system,
                                                      const BlockInputs* inputs, double time_s,
                                                      const ConstBlock& states);

}  // namespace polyest::internal
