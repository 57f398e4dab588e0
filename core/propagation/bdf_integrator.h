#pragma once

// Backward differentiation formulas of order 1 to 5, SUNDIALS' CVODE, on a block of trajectories
// that take common steps.

#include <memory>

#include "core/common/types.h"
#include "core/propagation/ensemble_integrator.h"

namespace polyest {

// Starts at time_s with these states. `system` must outlive the integrator.
std::unique_ptr<EnsembleIntegrator> MakeBdfIntegrator(EnsembleSystem* system,
                                                      double relative_tolerance, double time_s,
                                                      const ConstBlock& states);

}  // namespace polyest
