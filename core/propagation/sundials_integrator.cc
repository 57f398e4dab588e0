#include "core/propagation/sundials_integrator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/common/check.h"

namespace polyest::internal {

SundialsIntegrator::SundialsIntegrator(BlockSystem* system, double relative_tolerance,
                                       double time_s, const ConstBlock& states)
    : system_(system),
      scale_(system->points(), system->states(), relative_tolerance),
      floors_(system, &scale_),
      vector_(NewBlockVector(system->points(), system->states(), &scale_, context_)),
      time_s_(time_s),
      covered_s_(time_s) {
  BlockValues(vector()) = states;
  scale_.Grow(BlockValues(vector()));
}

int SundialsIntegrator::RightHandSide(double time_s, N_Vector states, N_Vector derivatives,
                                      void* self) {
  auto* const integrator = static_cast<SundialsIntegrator*>(self);
  const Eigen::ArrayXXd& x = BlockValues(states);
  integrator->scale_.Watch(&x);
  // A value that is not finite is left to the error norm, which identifies the point and makes the
  // solver shorten the step.
  integrator->system_->Derivatives(time_s, x, BlockValues(derivatives));
  return 0;
}

int SundialsIntegrator::ErrorWeights(N_Vector states, N_Vector weights, void* self) {
  auto* const integrator = static_cast<SundialsIntegrator*>(self);
  integrator->scale_.Grow(BlockValues(states));
  BlockValues(weights) = integrator->scale_.weights();
  return 0;
}

IntegratorOutcome SundialsIntegrator::Outcome(int flag, double advance_s, double span_s) const {
  IntegratorOutcome outcome;
  if (flag >= 0) return outcome;
  outcome.ok = false;
  outcome.flag = flag;
  outcome.reason = InWords(flag);
  outcome.worst_point = scale_.worst_point();
  constexpr int kTooMuchWork = -1;
  outcome.too_many_steps = flag == kTooMuchWork;
  // Many steps without progress: more of them will not help.
  constexpr double kStandstill = 1e-13;
  if (outcome.too_many_steps && !(advance_s > kStandstill * std::max(std::abs(time_s_), span_s))) {
    outcome.too_many_steps = false;
    outcome.reason = "the step size fell below the resolution of time";
  }
  return outcome;
}

IntegratorOutcome SundialsIntegrator::AdvanceTo(double time_s, double stop_time_s, int max_steps,
                                                Block states) {
  POLYEST_CHECK(time_s >= time_s_ && stop_time_s >= time_s);
  int flag = 0;
  const double before_s = std::max(time_s_, covered_s_);
  const double span_s = time_s - time_s_;
  if (time_s > covered_s_) {
    const Eigen::ArrayXXd& x = BlockValues(vector());
    const double step_s =
        first_step_set_ && LastStep() > 0 ? LastStep() : floors_.FirstStep(time_s_, x, span_s);
    floors_.Update(time_s_, x, step_s, span_s);
    if (!first_step_set_) SetFirstStep(step_s);
    first_step_set_ = true;
    // SUNDIALS cannot unset a stop time, so a time that is never reached is used for "none".
    const double stop_s = std::min(stop_time_s, std::numeric_limits<double>::max());
    flag = Evolve(time_s, stop_s, max_steps, vector(), &time_s_);
    covered_s_ = std::max(InternalTime(), time_s_);
  } else if (time_s > time_s_) {
    flag = Interpolate(time_s, vector());
    if (flag >= 0) time_s_ = time_s;
  }
  if (flag >= 0) states = BlockValues(vector());
  return Outcome(flag, covered_s_ - before_s, span_s);
}

// The right-hand side is the same as before, and so are the floors.
bool SundialsIntegrator::RestartFrom(const ConstBlock& states) {
  BlockValues(vector()) = states;
  scale_.Grow(BlockValues(vector()));
  const int flag = Reset(time_s_, vector());
  POLYEST_CHECK(flag == 0);
  covered_s_ = time_s_;
  return true;
}

void SundialsIntegrator::Restart() {
  const int flag = Reset(time_s_, vector());
  POLYEST_CHECK(flag == 0);
  covered_s_ = time_s_;
  scale_.ForgetFloors();
}

}  // namespace polyest::internal
