#pragma once

// Explicit Runge–Kutta of Dormand and Prince, order 5 with an embedded error estimate of order 4,
// SUNDIALS' ERKStep, on a block of trajectories that take common steps:
//
//   x_{n+1} = x_n + h Σ b_j k_j,  k_j = f(t_n + c_j h, x_n + h Σ_{i<j} a_ji k_i),
//   e = h Σ (b_j − b̂_j) k_j,      accepted if ‖e‖ ≤ 1 in the norm of ErrorScale.
//
// Between steps: ERKStep's own Hermite interpolant at its default degree. Other tables of ERKStep
// 6.4 lose their order; lower degrees of the interpolant lose accuracy at stop times.

#include <memory>

#include "core/common/types.h"
#include "core/propagation/ensemble_integrator.h"

namespace polyest {

// Starts at time_s with these states. `system` must outlive the integrator.
std::unique_ptr<EnsembleIntegrator> MakeErkIntegrator(EnsembleSystem* system,
                                                      double relative_tolerance, double time_s,
                                                      const ConstBlock& states);

}  // namespace polyest
