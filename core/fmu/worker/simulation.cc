#include "core/fmu/worker/simulation.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "core/common/status.h"
#include "core/fmu/worker/co_simulation.h"
#include "core/fmu/worker/event_trajectory.h"

namespace polyest::internal {
namespace {

Matrix MiddleRows(const Matrix& matrix, int first, int points) {
  return matrix.size() == 0 ? Matrix() : Matrix(matrix.middleRows(first, points));
}

// Returns the states that all outputs are, or nothing if an output is none.
std::vector<int> StatesOf(const StartMessage& start) {
  if (start.interface.kind != FmuKind::kModelExchange) return {};
  std::vector<int> states;
  for (const FmuVariable& output : start.outputs) {
    if (output.state == FmuVariable::kNoState) return {};
    states.push_back(output.state);
  }
  return states;
}

absl::Status CheckInstances(const FmuInterface& interface, Eigen::Index points) {
  if (!interface.once_per_process || interface.can_save_state || points == 1) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(
      absl::StrCat("the FMU can be instantiated only once per process and cannot save its state, "
                   "but ",
                   points, " trajectories are asked for"));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Simulation>> Simulation::Start(StartMessage start,
                                                              Monitor* monitor) {
  InputSignals signals;
  for (const InputSpecification& specification : start.signals) {
    POLYEST_ASSIGN_OR_RETURN(InputSignal signal, InputSignal::Make(specification));
    signals.push_back(std::move(signal));
  }
  POLYEST_RETURN_IF_ERROR(CheckInstances(start.interface, start.parameter_values.rows()));
  monitor->Enter(FmuCall::kLoad, 0);
  const auto load = start.interface.version == 2 ? LoadFmi2 : LoadFmi3;
  POLYEST_ASSIGN_OR_RETURN(std::unique_ptr<FmuLibrary> library,
                           load(start.interface, start.library, start.resources));
  monitor->Leave();
  std::unique_ptr<Simulation> simulation(
      new Simulation(std::move(start), std::move(signals), std::move(library), monitor));
  return simulation;
}

Simulation::Simulation(StartMessage start, InputSignals signals,
                       std::unique_ptr<FmuLibrary> library, Monitor* monitor)
    : start_(std::move(start)), signals_(std::move(signals)), library_(std::move(library)) {
  factory_.interface = start_.interface;
  factory_.parameters = start_.parameters;
  factory_.inputs = start_.inputs;
  factory_.outputs = start_.outputs;
  factory_.states_of_outputs = StatesOf(start_);
  factory_.relative_tolerance = start_.integration.relative_tolerance;
  factory_.library = library_.get();
  factory_.monitor = monitor;
  factory_.log = [this](const std::string& message) {
    factory_.said = message;
    factory_.monitor->Say(message);
  };
  channels_.amplitudes = start_.amplitudes;
  channels_.input_delays_s = start_.input_delays_s;
  channels_.input_offsets = start_.input_offsets;
}

absl::Status Simulation::AppendKnots(const AdvanceMessage& message) {
  for (const KnotsMessage& knots : message.knots) {
    const auto input = static_cast<size_t>(knots.input);
    if (input >= signals_.size() || knots.time_s.size() != knots.value.size()) {
      return absl::InternalError("knots of an input that is not there");
    }
    for (size_t i = 0; i < knots.time_s.size(); ++i) {
      signals_[input].Append(knots.time_s[i], knots.value[i]);
    }
    if (knots.finished && !signals_[input].finished()) signals_[input].Finish();
  }
  return absl::OkStatus();
}

std::unique_ptr<Instance> Simulation::MakeInstance(int row, const Vector& inputs) {
  const Vector parameters = start_.parameter_values.row(row).transpose();
  const auto span = [](const Vector& vector) {
    return std::span(vector.data(), static_cast<size_t>(vector.size()));
  };
  return std::make_unique<Instance>(&factory_, row, span(parameters), span(inputs));
}

// Called after the first knots of streamed inputs have arrived: initialization needs the inputs'
// first values.
void Simulation::MakeBlocks() {
  int first = 0;
  for (const int points : start_.block_points) {
    blocks_.push_back(MakeBlock(first, points));
    first += points;
  }
}

std::unique_ptr<TrajectoryEnsemble> Simulation::MakeBlock(int first, int points) {
  const FmuInterface& interface = start_.interface;
  std::vector<BlockInputs> inputs;
  std::vector<std::unique_ptr<Instance>> instances;
  bool events = interface.event_indicators > 0 || interface.needs_completed_step;
  for (int row = first; row < first + points; ++row) {
    inputs.emplace_back(channels_, &signals_, std::vector<int>{row});
    Vector values(static_cast<Eigen::Index>(signals_.size()));
    if (values.size() > 0) values = inputs.back().At(0).row(0).matrix().transpose();
    instances.push_back(MakeInstance(row, values));
    events = events || std::isfinite(instances.back()->next_event_s());
  }
  if (interface.kind == FmuKind::kModelExchange && !events) {
    EnsembleSpecification channels;
    channels.amplitudes = MiddleRows(start_.amplitudes, first, points);
    if (channels.amplitudes.rows() == 0) channels.amplitudes.resize(points, 0);
    channels.input_delays_s = MiddleRows(start_.input_delays_s, first, points);
    channels.input_offsets = MiddleRows(start_.input_offsets, first, points);
    channels.integration = start_.integration;
    auto model = std::make_shared<const ExchangeModel>(factory_, std::move(instances));
    return std::make_unique<ExchangeEnsemble>(std::move(model), std::move(channels), &signals_);
  }
  std::vector<std::unique_ptr<PointTrajectory>> trajectories;
  const int outputs = static_cast<int>(start_.outputs.size());
  for (size_t i = 0; i < instances.size(); ++i) {
    if (interface.kind == FmuKind::kCoSimulation) {
      trajectories.push_back(std::make_unique<CoSimulationPoint>(
          &start_.interface, std::move(instances[i]), std::move(inputs[i]),
          static_cast<int>(signals_.size()), outputs));
    } else {
      trajectories.push_back(std::make_unique<EventTrajectory>(
          &factory_, std::move(instances[i]), std::move(inputs[i]), start_.integration));
    }
  }
  return std::make_unique<PointwiseEnsemble>(std::move(trajectories), outputs);
}

absl::Status Simulation::Answer(const AdvanceMessage& message, ResultMessage& result) {
  POLYEST_RETURN_IF_ERROR(AppendKnots(message));
  if (blocks_.empty()) MakeBlocks();
  const Eigen::Index columns = std::ssize(message.times_s) * std::ssize(start_.outputs);
  Eigen::Index rows = 0;
  for (const auto& block : blocks_) rows += block->points();
  result.outputs.resize(rows, columns);
  Eigen::Index first = 0;
  for (const auto& block : blocks_) {
    Matrix outputs(block->points(), columns);
    POLYEST_RETURN_IF_ERROR(block->Advance(message.times_s, outputs, Stop()));
    result.outputs.middleRows(first, block->points()) = outputs;
    for (PointFailure failure : block->failures()) {
      failure.point += static_cast<int>(first);
      result.failures.push_back(std::move(failure));
    }
    first += block->points();
  }
  return absl::OkStatus();
}

// Makes the instances of the points whose initial states are asked for.
absl::Status Simulation::MakeInstances(const EvaluateMessage& message) {
  const auto points = static_cast<int>(start_.parameter_values.rows());
  if (equations_ == nullptr) equations_ = std::make_unique<ExchangeModel>(factory_, points);
  for (size_t row = 0; row < message.points.size(); ++row) {
    const int point = message.points[row];
    if (equations_->Has(point)) continue;
    auto instance = MakeInstance(point, message.inputs.row(static_cast<Eigen::Index>(row)));
    if (std::isfinite(instance->next_event_s())) {
      return absl::FailedPreconditionError(
          absl::StrFormat("filters need a model without events, but the FMU has one at t = %g s",
                          instance->next_event_s()));
    }
    equations_->Set(point, std::move(instance));
  }
  return absl::OkStatus();
}

absl::Status Simulation::Answer(const EvaluateMessage& message, ResultMessage& result) {
  using Values = EvaluateMessage::Values;
  const auto rows = static_cast<Eigen::Index>(message.points.size());
  Matrix points(rows, 1);
  for (Eigen::Index row = 0; row < rows; ++row) points(row, 0) = message.points[row];
  const Eigen::Index columns = message.values == Values::kOutputs
                                   ? std::ssize(start_.outputs)
                                   : Eigen::Index{start_.interface.states};
  Eigen::ArrayXXd values(rows, columns);
  switch (message.values) {
    case Values::kInitialStates:
      POLYEST_RETURN_IF_ERROR(MakeInstances(message));
      equations_->InitialStates(points.array(), values);
      break;
    case Values::kDerivatives:
      equations_->Derivatives(message.time_s, message.states.array(), points.array(),
                              message.inputs.array(), values);
      break;
    case Values::kOutputs:
      equations_->Outputs(message.time_s, message.states.array(), points.array(),
                          message.inputs.array(), values);
      break;
  }
  result.outputs = values.matrix();
  for (Eigen::Index row = 0; row < rows; ++row) {
    const Instance& instance = equations_->instance(message.points[row]);
    if (values.row(row).isFinite().all() || instance.failure().empty()) continue;
    result.failures.push_back(
        {message.points[row], message.time_s, instance.failure_status(), instance.failure()});
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
