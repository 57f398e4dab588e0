#include "core/propagation/sundials_block.h"

#include <algorithm>
#include <cmath>

namespace polyest {

SundialsBlock::SundialsBlock(EnsembleSystem* block_system, double relative_tolerance,
                             double start_s, const ConstBlock& states)
    : system(block_system),
      scale(system->points(), system->states(), relative_tolerance),
      vector(NewEnsembleVector(system->points(), system->states(), &scale, context)),
      time_s(start_s) {
  values() = states;
  scale.Grow(values());
}

int SundialsBlock::RightHandSide(double time_s, N_Vector states, N_Vector derivatives,
                                 void* block) {
  auto* const self = static_cast<SundialsBlock*>(block);
  const Eigen::ArrayXXd& x = EnsembleValues(states);
  self->scale.Watch(&x);
  self->system->Derivatives(time_s, x, EnsembleValues(derivatives));
  return 0;
}

int SundialsBlock::ErrorWeights(N_Vector states, N_Vector weights, void* block) {
  auto* const self = static_cast<SundialsBlock*>(block);
  self->scale.Grow(EnsembleValues(states));
  EnsembleValues(weights) = self->scale.weights();
  return 0;
}

double SundialsBlock::FirstStep(double span_s) {
  Eigen::ArrayXXd derivatives(system->points(), system->states());
  system->Derivatives(time_s, values(), derivatives);
  double step_s = span_s;
  for (Eigen::Index s = 0; s < derivatives.cols(); ++s) {
    const double rate = derivatives.col(s).abs().maxCoeff();
    const double candidate_s = 0.01 * scale.block_scale(s) / rate;
    if (std::isfinite(candidate_s) && candidate_s > 0) step_s = std::min(step_s, candidate_s);
  }
  return step_s;
}

}  // namespace polyest
