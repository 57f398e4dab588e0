#include "core/propagation/sundials_integrator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// Returns the largest magnitude, without values that are not finite; 0 if there is none.
double LargestFinite(const Eigen::Ref<const Eigen::ArrayXd>& values) {
  double largest = 0;
  for (const double value : values) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

}  // namespace

SundialsIntegrator::SundialsIntegrator(BlockSystem* system, double relative_tolerance,
                                       double time_s, const ConstBlock& states)
    : system_(system),
      scale_(system->points(), system->states(), relative_tolerance),
      vector_(NewBlockVector(system->points(), system->states(), &scale_, context_)),
      time_s_(time_s),
      covered_s_(time_s),
      first_rates_(system->points(), system->states()),
      moved_states_(system->points(), system->states()),
      moved_rates_(system->points(), system->states()) {
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

double SundialsIntegrator::FirstStep(double span_s) {
  system_->Derivatives(time_s_, BlockValues(vector()), first_rates_);
  double step_s = span_s / 64;
  for (Eigen::Index s = 0; s < first_rates_.cols(); ++s) {
    const double rate = first_rates_.col(s).abs().maxCoeff();
    const double candidate_s = 0.01 * scale_.block_scale(s) / rate;
    if (std::isfinite(candidate_s) && candidate_s > 0) step_s = std::min(step_s, candidate_s);
  }
  return step_s;
}

Vector SundialsIntegrator::ExpectedSizes(double span_s) {
  const Eigen::ArrayXXd& x = BlockValues(vector());
  Vector expected = Vector::Zero(x.cols());
  // One pass finds what an input moves, the next what that moves in turn, and so on to the end of
  // the longest chain.
  constexpr double kOnTheWay[] = {0, 0.25, 0.5, 0.75, 1};
  for (Eigen::Index pass = 0; pass <= x.cols(); ++pass) {
    moved_states_ = x.rowwise() + expected.transpose().array();
    const Vector before = expected;
    for (const double share : kOnTheWay) {
      system_->Derivatives(time_s_ + share * span_s, moved_states_, moved_rates_);
      for (Eigen::Index s = 0; s < x.cols(); ++s) {
        if (scale_.block_scale(s) > 0 || before(s) > 0) continue;
        expected(s) = std::max(expected(s), span_s * LargestFinite(moved_rates_.col(s)));
      }
    }
    if (expected == before) break;
  }
  return expected;
}

void SundialsIntegrator::SetFloors(double step_s, double span_s) {
  floors_step_s_ = step_s;
  const Vector expected = ExpectedSizes(span_s);
  const double root_epsilon = std::sqrt(std::numeric_limits<double>::epsilon());
  const Eigen::ArrayXXd& x = BlockValues(vector());
  system_->Derivatives(time_s_, x, first_rates_);
  // The shares of the states differ, so that their effects do not cancel.
  for (Eigen::Index s = 0; s < x.cols(); ++s) {
    const double share = 1 - 0.5 * std::abs(std::sin(static_cast<double>(s)));
    moved_states_.col(s) =
        x.col(s) + root_epsilon * share * std::max(scale_.block_scale(s), expected(s));
  }
  system_->Derivatives(time_s_, moved_states_, moved_rates_);
  moved_rates_ = first_rates_.abs() + (moved_rates_ - first_rates_).abs() / root_epsilon;
  Vector changes(x.cols());
  for (Eigen::Index s = 0; s < x.cols(); ++s) {
    changes(s) = step_s * LargestFinite(moved_rates_.col(s));
  }
  scale_.SetFloors(changes, expected);
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
    const double step_s = first_step_set_ && LastStep() > 0 ? LastStep() : FirstStep(span_s);
    constexpr double kLonger = 4;
    if (scale_.NeedsFloors() || step_s > kLonger * floors_step_s_) SetFloors(step_s, span_s);
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
