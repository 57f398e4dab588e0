#pragma once

// Backward differentiation formulas of order 1 to 5, SUNDIALS' CVODE, on a block of trajectories
// that take common steps. For the part of the step that is implicit,
//
//   x − γ f(t, x) − known = 0,
//
// Newton's matrix I − γ ∂f/∂x has one small block a point. The blocks of the Jacobian are
// exact where the system has them, otherwise they come from differences that move one state of all
// points at once, and are factored kLanes points at a time.
// They are kept while the iteration converges: factored anew when γ has changed by more than 30 %,
// evaluated anew after 20 steps or a failure to converge; in between, the correction is scaled by
// 2/(1 + γ/γ_factored).

#include <memory>

#include "core/common/types.h"
#include "core/propagation/ensemble_integrator.h"

namespace polyest {

// Starts at time_s with these states. `system` must outlive the integrator.
std::unique_ptr<EnsembleIntegrator> MakeBdfIntegrator(EnsembleSystem* system,
                                                      double relative_tolerance, double time_s,
                                                      const ConstBlock& states);

}  // namespace polyest
