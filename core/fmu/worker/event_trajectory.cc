#include "core/fmu/worker/event_trajectory.h"

#include <absl/strings/str_format.h>
#include <cvode/cvode.h>
#include <cvode/cvode_ls.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "core/common/check.h"
#include "core/propagation/output_limit.h"

namespace polyest::internal {
namespace {

constexpr double kAbsoluteTolerance = 1e-14;
constexpr double kNominalShare = 1e-3;
// More consecutive events than this, each within kClose (relative to max(1, t)) of the one before,
// count as accumulating.
constexpr int kMaxCloseEvents = 10;
constexpr double kClose = 1e-8;

// Whether stop_s is too close to time_s for an integrator to resolve the difference.
bool IsThere(double time_s, double stop_s) {
  constexpr double kResolution = 8 * std::numeric_limits<double>::epsilon();
  return stop_s - time_s <= kResolution * std::max(std::abs(time_s), std::abs(stop_s));
}

}  // namespace

EventTrajectory::EventTrajectory(const InstanceFactory* factory, std::unique_ptr<Instance> instance,
                                 BlockInputs inputs, const IntegrationOptions& options)
    : factory_(*factory),
      instance_(std::move(instance)),
      inputs_(std::move(inputs)),
      relative_tolerance_(options.relative_tolerance),
      max_steps_(options.max_steps) {
  // Without states, a dummy state that stays 0 lets the same solver search for events.
  const int count = std::max(1, factory_.interface.states);
  states_ = N_VNew_Serial(count, context_);
  N_VConst(0, states_);
  largest_.setOnes(count);
  const std::span<double> nominals(largest_.data(), static_cast<size_t>(factory_.interface.states));
  if (!instance_->GetNominals(nominals) || !instance_->GetStates(States(states_))) {
    Fail(instance_->failure());
    return;
  }
  largest_ = kNominalShare * largest_.cwiseAbs();
  MakeSolver(options.method);
}

EventTrajectory::~EventTrajectory() {
  if (solver_ != nullptr) CVodeFree(&solver_);
  if (linear_solver_ != nullptr) SUNLinSolFree(linear_solver_);
  if (fixed_point_ != nullptr) SUNNonlinSolFree(fixed_point_);
  if (matrix_ != nullptr) SUNMatDestroy(matrix_);
  N_VDestroy(states_);
}

void EventTrajectory::MakeSolver(IntegrationMethod method) {
  const bool adams = method == IntegrationMethod::kExplicit;
  const auto count = N_VGetLength(states_);
  solver_ = CVodeCreate(adams ? CV_ADAMS : CV_BDF, context_);
  POLYEST_CHECK(solver_ != nullptr);
  bool accepted =
      CVodeSetErrHandlerFn(solver_, IgnoreMessage, nullptr) == CV_SUCCESS &&
      CVodeInit(solver_, RightHandSide, 0, states_) == CV_SUCCESS &&
      CVodeSetUserData(solver_, this) == CV_SUCCESS &&
      CVodeWFtolerances(solver_, ErrorWeights) == CV_SUCCESS &&
      CVodeRootInit(solver_, factory_.interface.event_indicators, EventIndicators) == CV_SUCCESS &&
      CVodeSetNoInactiveRootWarn(solver_) == CV_SUCCESS;
  if (adams) {
    fixed_point_ = SUNNonlinSol_FixedPoint(states_, 0, context_);
    accepted = accepted && CVodeSetNonlinearSolver(solver_, fixed_point_) == CV_SUCCESS;
  } else {
    matrix_ = SUNDenseMatrix(count, count, context_);
    linear_solver_ = SUNLinSol_Dense(states_, matrix_, context_);
    accepted = accepted && CVodeSetLinearSolver(solver_, linear_solver_, matrix_) == CV_SUCCESS;
  }
  POLYEST_CHECK(accepted);
}

std::span<double> EventTrajectory::States(N_Vector vector) const {
  return {N_VGetArrayPointer(vector), static_cast<size_t>(factory_.interface.states)};
}

bool EventTrajectory::SetPoint(double time_s, N_Vector states) {
  const Vector values = inputs_.At(time_s).row(0).matrix().transpose();
  return instance_->SetPoint(time_s, States(states), values.data());
}

int EventTrajectory::RightHandSide(double time_s, N_Vector states, N_Vector derivatives,
                                   void* self) {
  auto& trajectory = *static_cast<EventTrajectory*>(self);
  return trajectory.held_.Guard(kFailed, [&] {
    N_VConst(0, derivatives);
    const std::span<double> rates = trajectory.States(derivatives);
    // A value that the FMU discards here may be defined closer to the beginning of the step.
    constexpr int kTryShorterStep = 1;
    if (!trajectory.SetPoint(time_s, states) || !trajectory.instance_->GetDerivatives(rates)) {
      return trajectory.instance_->broken() ? kFailed : kTryShorterStep;
    }
    const auto is_finite = [](double rate) { return std::isfinite(rate); };
    return std::all_of(rates.begin(), rates.end(), is_finite) ? 0 : kTryShorterStep;
  });
}

int EventTrajectory::EventIndicators(double time_s, N_Vector states, double* indicators,
                                     void* self) {
  auto& trajectory = *static_cast<EventTrajectory*>(self);
  const auto count = static_cast<size_t>(trajectory.factory_.interface.event_indicators);
  return trajectory.held_.Guard(kFailed, [&] {
    const bool good = trajectory.SetPoint(time_s, states) &&
                      trajectory.instance_->GetEventIndicators({indicators, count});
    return good ? 0 : kFailed;
  });
}

int EventTrajectory::ErrorWeights(N_Vector states, N_Vector weights, void* self) {
  auto& trajectory = *static_cast<EventTrajectory*>(self);
  const double* const x = N_VGetArrayPointer(states);
  double* const w = N_VGetArrayPointer(weights);
  for (Eigen::Index s = 0; s < trajectory.largest_.size(); ++s) {
    double& largest = trajectory.largest_[s];
    if (std::isfinite(x[s])) largest = std::max(largest, std::abs(x[s]));
    // 1 / (rtol · S + atol)
    w[s] = 1 / (trajectory.relative_tolerance_ * largest + kAbsoluteTolerance);
  }
  return 0;
}

// Discards the solver's history.
void EventTrajectory::Restart(double span_s) {
  // The first step must be small enough to notice an input that is 0 now. It must also be small
  // compared with the time since the event before: the solver checks an event indicator that is 0
  // now only from a tenth of the first step on, and the next event may follow as soon as the last
  // one did.
  constexpr double kOfSpan = 1.0 / 64;
  constexpr double kOfEvents = 1.0 / 16;
  constexpr double kMin = 1e-12;
  const double step_s = std::max(std::min(kOfSpan * span_s, kOfEvents * since_event_s_),
                                 kMin * std::max(1.0, time_s_));
  const bool accepted = CVodeReInit(solver_, time_s_, states_) == CV_SUCCESS &&
                        CVodeSetInitStep(solver_, std::isfinite(step_s) ? step_s : 0) == CV_SUCCESS;
  POLYEST_CHECK(accepted);
}

bool EventTrajectory::AdvanceTo(double time_s) {
  if (solver_ == nullptr || !failure_.reason.empty()) return false;
  steps_ = 0;
  bool restart = time_s_ == 0;
  while (time_s > time_s_) {
    const BlockInputs::Break next = inputs_.NextBreak();
    const double stop_s = std::min({time_s, next.time_s, instance_->next_event_s()});
    if (restart) Restart(std::min(time_s, next.time_s) - time_s_);
    restart = false;
    bool event = false;
    if (!Integrate(stop_s, event)) return false;
    if (time_s_ >= next.time_s) {
      inputs_.Pass(next.time_s);
      event = event || next.jumps;
      restart = true;
    }
    event = event || time_s_ >= instance_->next_event_s();
    if (event && !HandleEvent()) return false;
    restart = restart || event;
  }
  return true;
}

bool EventTrajectory::Integrate(double stop_s, bool& event) {
  if (IsThere(time_s_, stop_s)) {
    time_s_ = std::max(time_s_, stop_s);
    Restart(0);
    return true;
  }
  CVodeSetStopTime(solver_, stop_s);
  while (time_s_ < stop_s && !event) {
    if (++steps_ > max_steps_) return Fail("too many steps between two samples");
    const int flag = CVode(solver_, stop_s, states_, &time_s_, CV_ONE_STEP);
    held_.Rethrow();
    if (flag < 0) return Fail(flag);
    event = flag == CV_ROOT_RETURN;
    if (factory_.interface.needs_completed_step && !CompleteStep(event)) return false;
  }
  return true;
}

bool EventTrajectory::CompleteStep(bool& event) {
  bool asked_for = false;
  if (!SetPoint(time_s_, states_) || !instance_->CompletedStep(asked_for)) {
    return Fail(instance_->failure());
  }
  event = event || asked_for;
  return true;
}

bool EventTrajectory::HandleEvent() {
  if (!CheckAccumulation()) return false;
  if (!SetPoint(time_s_, states_) || !instance_->HandleEvent() ||
      !instance_->GetStates(States(states_))) {
    return Fail(instance_->failure());
  }
  return true;
}

bool EventTrajectory::CheckAccumulation() {
  since_event_s_ = time_s_ - last_event_s_;
  const bool close = since_event_s_ < kClose * std::max(1.0, time_s_);
  close_events_ = close ? close_events_ + 1 : 0;
  last_event_s_ = time_s_;
  if (close_events_ <= kMaxCloseEvents) return true;
  return Fail(absl::StrFormat("more than %d events follow each other within %g s: they accumulate",
                              kMaxCloseEvents, kClose));
}

bool EventTrajectory::ReadOutputs(double* outputs) {
  if (!failure_.reason.empty()) return false;
  const std::vector<int>& known = factory_.states_of_outputs;
  for (size_t i = 0; i < known.size(); ++i) {
    outputs[i] = States(states_)[static_cast<size_t>(known[i])];
  }
  if (known.empty() && (!SetPoint(time_s_, states_) || !instance_->GetOutputs(outputs))) {
    return FailSinceRead(instance_->failure());
  }
  const char* const reason =
      FailureOfOutputs(Eigen::Map<const Eigen::ArrayXd>(outputs, std::ssize(factory_.outputs)));
  if (reason != nullptr) return FailSinceRead(reason);
  read_s_ = time_s_;
  return true;
}

bool EventTrajectory::Fail(int flag) {
  failure_.flag = flag;
  const bool by_fmu = flag == CV_RHSFUNC_FAIL || flag == CV_FIRST_RHSFUNC_ERR ||
                      flag == CV_REPTD_RHSFUNC_ERR || flag == CV_UNREC_RHSFUNC_ERR ||
                      flag == CV_RTFUNC_FAIL || flag == CV_LSETUP_FAIL;
  if (by_fmu && !instance_->failure().empty()) return Fail(instance_->failure());
  char* const name = CVodeGetReturnFlagName(flag);
  const std::string reason = absl::StrFormat("the integrator CVODE ended with %s", name);
  std::free(name);
  return Fail(reason);
}

bool EventTrajectory::Fail(const std::string& reason) {
  failure_.reason = reason;
  failure_.time_s = time_s_;
  if (failure_.flag == 0) failure_.flag = instance_->failure_status();
  return false;
}

// The time at which outputs were last valid is known; the time at which they became invalid is not.
bool EventTrajectory::FailSinceRead(const std::string& reason) {
  Fail(reason);
  failure_.time_s = read_s_;
  return false;
}

PointFailure EventTrajectory::failure() const { return failure_; }

}  // namespace polyest::internal
