#pragma once

// Backward differentiation formulas of order 1 to 5, SUNDIALS' CVODE, on a block of trajectories
// that take common steps. For the part of the step that is implicit,
//
//   x − γ f(t, x) − known = 0,
//
// Newton's matrix I − γ ∂f/∂x has one small block for each point. The blocks of the Jacobian are
// exact if the system provides them; otherwise they come from differences that move one state of
// all points at once. They are factored for kLanes points at a time, and kept while the iteration
// converges: factored again when γ has changed by more than 30 %, evaluated again after 20 steps or
// a failure to converge. In between, the correction is scaled by 2/(1 + γ/γ_factored).

#include <memory>

#include "core/common/types.h"
#include "core/propagation/block_integrator.h"

namespace polyest::internal {

// Makes an integrator that starts at `time_s` with `states`. `system` must outlive it.
std::unique_ptr<BlockIntegrator> MakeBdfIntegrator(BlockSystem* system, double relative_tolerance,
                                                   double time_s, const ConstBlock& states);

}  // namespace polyest::internal
