#include "core/propagation/trajectory_block.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/propagation/bdf_integrator.h"
#include "core/propagation/block_rows.h"
#include "core/propagation/linear_integrator.h"
#include "core/propagation/linear_system.h"
#include "core/propagation/output_limit.h"
#include "core/propagation/runge_kutta_integrator.h"
#include "core/propagation/switching_integrator.h"

namespace polyest::internal {
namespace {

// Number of steps between two checks of the stop request.
constexpr int kStepsAtOnce = 500;
// A multistep method evaluates an input only at the ends of its steps. One long step from rest over
// a bump that is 0 at both ends would miss the bump. So after each break the integrator stops once
// after this fraction of the interval to the next break.
constexpr double kLook = 1.0 / 64;

std::vector<int> Shifted(std::vector<int> rows, int first) {
  for (int& row : rows) row += first;
  return rows;
}

// Returns the model if its equations switch, else null.
const SwitchingModel* SwitchingOrNull(const Model* model) {
  const auto* switching = dynamic_cast<const SwitchingModel*>(model);
  return switching != nullptr && !switching->switches().empty() ? switching : nullptr;
}

}  // namespace

TrajectoryBlock::TrajectoryBlock(const EnsembleSpecification* specification,
                                 const InputSignals* inputs, int first_point, int points,
                                 bool exact)
    : specification_(specification),
      model_(dynamic_cast<const StateSpaceModel*>(specification->model.get())),
      switching_(SwitchingOrNull(specification->model.get())),
      first_point_(first_point),
      signals_(inputs),
      exact_(exact),
      source_(PaddedRows(points)),
      parameters_(specification->parameters(Shifted(source_, first_point), Eigen::all).array()),
      inputs_(*specification, inputs, Shifted(source_, first_point)),
      point_alive_(points, true),
      alive_points_(points),
      stiff_(specification->integration.method == IntegrationMethod::kStiff) {
  POLYEST_CHECK(model_ != nullptr);
  const ModelDescription& description = model_->description();
  const Eigen::Index rows = parameters_.rows();
  for (const InputSignal& input : *inputs) streamed_ = streamed_ || input.streamed();
  stops_at_samples_ = streamed_ || model_->uses_time();
  if (exact_) inputs_.StopAtEveryKnot();
  states_.setZero(rows, static_cast<Eigen::Index>(description.states.size()));
  model_outputs_.setZero(rows, static_cast<Eigen::Index>(description.outputs.size()));
  selected_outputs_.setZero(rows, static_cast<Eigen::Index>(specification->outputs.size()));
  const size_t switches = switching_ == nullptr ? 0 : switching_->switches().size();
  modes_.setConstant(rows, static_cast<Eigen::Index>(switches),
                     std::numeric_limits<double>::quiet_NaN());
  if (states_.cols() == 0) return;
  model_->InitialStates(parameters_, states_);
  FailRowsBeyond(states_, 0, "an initial state");
  StartIntegrator(0);
}

void TrajectoryBlock::StartIntegrator(double time_s) {
  integrator_.reset();
  integrated_points_ = alive_points_;
  if (!alive()) return;
  if (exact_) {
    integrator_ = MakeLinearIntegrator(LinearSystemOf(*model_, parameters_, *signals_, inputs_),
                                       &inputs_, time_s, states_);
    return;
  }
  const double tolerance = specification_->integration.relative_tolerance;
  if (switching_ != nullptr && !stiff_) {
    integrator_ = std::make_unique<SwitchingIntegrator>(switching_, &parameters_, &inputs_,
                                                        tolerance, time_s, states_, &modes_);
    return;
  }
  integrator_ = stiff_ ? MakeBdfIntegrator(this, tolerance, time_s, states_)
                       : MakeRungeKuttaIntegrator(this, tolerance, time_s, states_);
}

bool TrajectoryBlock::MayChangeMethod() const {
  return specification_->integration.method == IntegrationMethod::kAuto && !stiff_;
}

void TrajectoryBlock::Derivatives(double time_s, const ConstBlock& states, Block derivatives) {
  model_->Derivatives(time_s, states, parameters_, inputs_.At(time_s), derivatives);
}

void TrajectoryBlock::FirstDerivatives(double time_s, const Eigen::ArrayXXd& states,
                                       Block derivatives) {
  first_parameters_ = parameters_.row(0).replicate(states.rows(), 1);
  first_inputs_ = inputs_.At(time_s).row(0).replicate(states.rows(), 1);
  model_->Derivatives(time_s, states, first_parameters_, first_inputs_, derivatives);
}

bool TrajectoryBlock::StateJacobian(double time_s, const ConstBlock& states, Block jacobian) {
  if (!model_->has_state_jacobian()) return false;
  model_->StateJacobian(time_s, states, parameters_, inputs_.At(time_s), jacobian);
  return true;
}

TrajectoryBlock::StopTime TrajectoryBlock::NextStop() {
  const BlockInputs::Break next = inputs_.NextBreak();
  const StopTime stop = {next.time_s, next.jumps, true};
  if (exact_) return stop;
  const double step_end_s = inputs_.StepEnd(time_s_);
  const StopTime early = step_end_s < stop.time_s ? StopTime{step_end_s, false, false} : stop;
  if (!stiff_ || streamed_ || next.time_s == kInfinity) return early;
  const double look_s = last_break_s_ + kLook * (next.time_s - last_break_s_);
  return look_s > time_s_ && look_s < early.time_s ? StopTime{look_s, false, false} : early;
}

absl::Status TrajectoryBlock::Advance(std::span<const double> times_s, MatrixRef outputs,
                                      const Stop& stop) {
  for (int sample = 0; sample < static_cast<int>(times_s.size()); ++sample) {
    // An exact step takes no longer than a look at the clock.
    if (!exact_ || sample == 0) POLYEST_RETURN_IF_ERROR(stop.Check());
    const double time_s = times_s[sample];
    POLYEST_CHECK(time_s >= time_s_);
    if (integrator_) POLYEST_RETURN_IF_ERROR(AdvanceStates(time_s, stop));
    ReadOutputs(time_s, sample, outputs);
    time_s_ = time_s;
  }
  return absl::OkStatus();
}

absl::Status TrajectoryBlock::AdvanceStates(double time_s, const Stop& stop) {
  for (;;) {
    const StopTime next = NextStop();
    if (next.time_s > time_s) {
      return Reach(time_s, stops_at_samples_ ? time_s : next.time_s, stop);
    }
    POLYEST_RETURN_IF_ERROR(Reach(next.time_s, next.time_s, stop));
    time_s_ = next.time_s;
    if (next.is_break) {
      last_break_s_ = time_s_;
      inputs_.Pass(time_s_);
    }
    if (next.jumps && integrator_) integrator_->Restart();
  }
}

absl::Status TrajectoryBlock::Reach(double time_s, double stop_time_s, const Stop& stop) {
  const int max_steps = specification_->integration.max_steps;
  int steps = 0;
  while (integrator_) {
    const int steps_at_once = std::min(kStepsAtOnce, max_steps - steps);
    const IntegratorOutcome outcome =
        integrator_->AdvanceTo(time_s, stop_time_s, steps_at_once, states_);
    steps += steps_at_once;
    const bool may_go_on = outcome.too_many_steps && steps < max_steps;
    const bool change = MayChangeMethod() && (outcome.ok || outcome.too_many_steps) &&
                        (integrator_->LooksStiff() || !(outcome.ok || may_go_on));
    if (!change && outcome.ok) break;
    if (!change && may_go_on) {
      POLYEST_RETURN_IF_ERROR(stop.Check());
      continue;
    }
    const double good_s = integrator_->time_s();
    states_ = integrator_->states();
    if (change) {
      stiff_ = true;
    } else {
      Fail(outcome.worst_point, good_s, outcome.flag, outcome.reason);
    }
    StartIntegrator(good_s);
    steps = 0;
  }
  return absl::OkStatus();
}

void TrajectoryBlock::ReadOutputs(double time_s, int sample, MatrixRef outputs) {
  const Eigen::Index columns = selected_outputs_.cols();
  if (alive()) {
    if (!integrator_ || !integrator_->Outputs(time_s, states_, model_outputs_)) {
      model_->Outputs(time_s, states_, parameters_, inputs_.At(time_s), model_outputs_);
    }
    SelectOutputs();
    const int alive_before = alive_points_;
    FailRowsBeyond(selected_outputs_, time_s_, "an output");
    if (alive_points_ < alive_before && states_.cols() > 0) StartIntegrator(time_s);
  }
  const Eigen::Index points = std::ssize(point_alive_);
  auto present = outputs.block(first_point_, sample * columns, points, columns);
  present = selected_outputs_.topRows(points).matrix();
  if (alive_points_ == points) return;
  for (Eigen::Index point = 0; point < points; ++point) {
    if (!point_alive_[point]) {
      present.row(point).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
}

void TrajectoryBlock::SelectOutputs() {
  const std::vector<int>& selected = specification_->outputs;
  for (Eigen::Index j = 0; j < selected_outputs_.cols(); ++j) {
    selected_outputs_.col(j) = model_outputs_.col(selected[j]);
  }
}

void TrajectoryBlock::CopyStates(const Eigen::ArrayXXd& states) {
  for (Eigen::Index column = 0; column < states_.cols(); ++column) {
    for (Eigen::Index row = 0; row < states_.rows(); ++row) {
      states_(row, column) = states(source_[row], column);
    }
  }
}

void TrajectoryBlock::SetStates(const Eigen::ArrayXXd& states) {
  CopyStates(states);
  FailRowsBeyond(states_, time_s_, "a state");
}

const Eigen::ArrayXXd& TrajectoryBlock::OutputsAt(const Eigen::ArrayXXd& states) {
  CopyStates(states);
  model_->Outputs(time_s_, states_, parameters_, inputs_.At(time_s_), model_outputs_);
  SelectOutputs();
  return selected_outputs_;
}

void TrajectoryBlock::SetTime(double time_s) {
  integrator_.reset();
  time_s_ = time_s;
}

const Eigen::ArrayXXd& TrajectoryBlock::OutputsOfStates() {
  model_->Outputs(time_s_, states_, parameters_, inputs_.At(time_s_), model_outputs_);
  SelectOutputs();
  FailRowsBeyond(selected_outputs_, time_s_, "an output");
  return selected_outputs_;
}

absl::StatusOr<const Eigen::ArrayXXd*> TrajectoryBlock::Move(double time_s, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(stop.Check());
  POLYEST_CHECK(time_s >= time_s_);
  // The states are set anew at the end, to where the steps must not go on.
  stops_at_samples_ = true;
  if (alive()) {
    // The matrices of linear models are those of the points that have not failed.
    const bool same = alive_points_ == integrated_points_ && integrator_ != nullptr;
    if (!same || !integrator_->RestartFrom(states_)) StartIntegrator(time_s_);
    POLYEST_RETURN_IF_ERROR(AdvanceStates(time_s, stop));
    FailRowsBeyond(states_, time_s, "a state");
  }
  time_s_ = time_s;
  return &states_;
}

void TrajectoryBlock::LeaveOut(std::span<const int> points, const char* reason) {
  for (const int point : points) {
    if (IsAlive(point)) Fail(point, time_s_, 0, reason);
  }
}

void TrajectoryBlock::FailRowsBeyond(const Eigen::ArrayXXd& values, double time_s,
                                     const char* what) {
  if (values.size() == 0 || values.abs().maxCoeff<Eigen::PropagateNaN>() <= kMaxOutput) return;
  for (Eigen::Index row = 0; row < std::ssize(point_alive_); ++row) {
    if (!point_alive_[row] || (values.row(row).abs() <= kMaxOutput).all()) continue;
    const bool finite = values.row(row).isFinite().all();
    Fail(row, time_s, 0,
         absl::StrCat(what, finite ? " exceeds 1e100 in magnitude" : " is not finite"));
  }
}

void TrajectoryBlock::Fail(Eigen::Index row, double time_s, int flag, std::string reason) {
  const int point = source_[row];
  POLYEST_CHECK(point_alive_[point]);
  point_alive_[point] = false;
  --alive_points_;
  failures_.push_back({first_point_ + point, time_s, flag, std::move(reason)});
  const auto donor = std::find(point_alive_.begin(), point_alive_.end(), true);
  if (donor == point_alive_.end()) {
    integrator_.reset();
    return;
  }
  const auto healthy = static_cast<Eigen::Index>(donor - point_alive_.begin());
  for (Eigen::Index copy = 0; copy < std::ssize(source_); ++copy) {
    if (source_[copy] != point) continue;
    CarryPoint(copy, healthy);
    states_.row(copy) = states_.row(healthy);
    modes_.row(copy) = modes_.row(healthy);
  }
}

// Makes the row a copy of the point, whose values are in its own row.
void TrajectoryBlock::CarryPoint(Eigen::Index row, Eigen::Index point) {
  source_[row] = static_cast<int>(point);
  parameters_.row(row) = parameters_.row(point);
  inputs_.CopyRow(point, row);
}

void TrajectoryBlock::Restart() {
  if (states_.cols() == 0 || !alive()) return;
  // Whatever is known of the inputs now, breaks up to the present time are in the past.
  inputs_.NextBreak();
  inputs_.Pass(time_s_);
  StartIntegrator(time_s_);
}

EnsembleState::OfBlock TrajectoryBlock::State() const {
  return {source_, point_alive_, states_, modes_, stiff_, last_break_s_, failures_};
}

bool TrajectoryBlock::Fits(const EnsembleState::OfBlock& state) const {
  const auto points = std::ssize(point_alive_);
  if (state.source.size() != source_.size() || std::ssize(state.alive) != points ||
      state.states.rows() != states_.rows() || state.states.cols() != states_.cols() ||
      state.modes.rows() != modes_.rows() || state.modes.cols() != modes_.cols() ||
      state.modes.isInf().any() || !std::isfinite(state.last_break_s)) {
    return false;
  }
  for (const PointFailure& failure : state.failures) {
    if (failure.point < first_point_ || failure.point >= first_point_ + points) return false;
  }
  if (std::ranges::count(state.alive, true) == 0) return true;
  for (Eigen::Index row = 0; row < std::ssize(state.source); ++row) {
    const int source = state.source[row];
    if (source < 0 || source >= points || !state.alive[source]) return false;
    if (row < points && state.alive[row] && source != row) return false;
  }
  return state.states.isFinite().all();
}

void TrajectoryBlock::Restore(double time_s, const EnsembleState::OfBlock& state) {
  point_alive_ = state.alive;
  alive_points_ = static_cast<int>(std::ranges::count(point_alive_, true));
  for (Eigen::Index row = 0; alive() && row < std::ssize(source_); ++row) {
    if (state.source[row] != row) CarryPoint(row, state.source[row]);
  }
  source_ = state.source;
  states_ = state.states;
  modes_ = state.modes;
  stiff_ = state.stiff;
  time_s_ = time_s;
  last_break_s_ = state.last_break_s;
  failures_ = state.failures;
  integrator_.reset();
  Restart();
}

}  // namespace polyest::internal
