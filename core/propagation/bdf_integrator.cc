#include "core/propagation/bdf_integrator.h"

#include "core/propagation/erk_integrator.h"

namespace polyest {

std::unique_ptr<EnsembleIntegrator> MakeBdfIntegrator(EnsembleSystem* system,
                                                      double relative_tolerance, double time_s,
                                                      const ConstBlock& states) {
  return MakeErkIntegrator(system, relative_tolerance, time_s, states);
}

}  // namespace polyest
