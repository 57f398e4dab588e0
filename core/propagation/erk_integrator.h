#pragma once

// The explicit Runge–Kutta method of Dormand and Prince, order 5 with an embedded error estimate of
// order 4, by SUNDIALS' ERKStep, on a block of trajectories that take common steps:
//
//   x_{n+1} = x_n + h Σ b_j k_j,  k_j = f(t_n + c_j h, x_n + h Σ_{i<j} a_ji k_i),
//   e = h Σ (b_j − b̂_j) k_j,      accepted if ‖e‖ ≤ 1 in the norm of ErrorScale.
//
// Between steps it uses ERKStep's Hermite interpolant at its default degree. Other tables of
// ERKStep 6.4 lose their order, and lower degrees of the interpolant lose accuracy at stop times.

#include <memory>

#include "core/common/types.h"
#include "core/propagation/block_integrator.h"

namespace polyest::internal {

// Makes an integrator that starts at `time_s` with `states`. `system` must outlive it.
std::unique_ptr<BlockIntegrator> MakeErkIntegrator(BlockSystem* system, double relative_tolerance,
                                                   double time_s, const ConstBlock& states);

}  // namespace polyest::internal
