#pragma once

// The explicit Runge–Kutta methods of order 5 and 8 of Dormand and Prince (dormand_prince_tables.h)
// on a block of trajectories that take common steps, of the order that costs less (order_choice.h):
//
//   x_{n+1} = x_n + h Σ b_j k_j,  k_j = f(t_n + c_j h, x_n + h Σ_{i<j} a_ji k_i),
//
// accepted if ‖e‖ ≤ 1 in the norm of ErrorScale. With order 5, e is the embedded estimate. With
// order 8 it is e_5² ÷ max(|e_5|, |e_3|/10) in every component, e_5 and e_3 the estimates of order
// 5 and 3, which is of order 7 (Hairer, Nørsett, Wanner, II.10, who take √(e_5² + e_3²/100) in
// place of the maximum). Between steps each order has its interpolant, of order 4 and 7; the three
// further stages of the latter are computed when a sample needs them.

#include <memory>

#include "core/common/types.h"
#include "core/propagation/block_integrator.h"

namespace polyest::internal {

// Makes an integrator that starts at `time_s` with `states`. `system` must outlive it.
std::unique_ptr<BlockIntegrator> MakeRungeKuttaIntegrator(BlockSystem* system,
                                                          double relative_tolerance, double time_s,
                                                          const ConstBlock& states);

}  // namespace polyest::internal
