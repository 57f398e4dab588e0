#include "core/fmu/fmu_equations.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/fmu/conversation.h"
#include "core/propagation/block_inputs.h"

namespace polyest::internal {
namespace {

// Returns a model of the ensemble's points that has the FMU's states and inputs, and the outputs
// that the ensemble reads.
ModelDescription OfPoints(const ModelDescription& fmu, const std::vector<int>& outputs) {
  ModelDescription description;
  description.name = fmu.name;
  description.states = fmu.states;
  description.inputs = fmu.inputs;
  description.parameters.emplace_back().name = "point";
  for (const int output : outputs) {
    description.outputs.push_back(fmu.outputs[static_cast<size_t>(output)]);
  }
  return description;
}

}  // namespace

FmuEquations::FmuEquations(std::shared_ptr<const UnpackedFmu> fmu,
                           const EnsembleSpecification& specification, const InputSignals* inputs,
                           int points_together, const WorkerLimits& limits)
    : fmu_(std::move(fmu)),
      specification_(specification),
      inputs_(inputs),
      limits_(limits),
      description_(OfPoints(fmu_->description.model, specification.outputs)),
      ended_(fmu_->status) {
  const int points = static_cast<int>(specification.parameters.rows());
  const int groups = (points + points_together - 1) / points_together;
  const int count = std::max(1, std::min(specification.threads, groups));
  for (int i = 0; i < count; ++i) workers_.push_back(std::make_unique<Worker>());
  for (int point = 0; point < points; ++point) {
    Worker& worker = *workers_[static_cast<size_t>(point / points_together % count)];
    worker_of_.push_back(&worker);
    row_of_.push_back(static_cast<int>(worker.points.size()));
    worker.points.push_back(point);
  }
  failure_of_.resize(static_cast<size_t>(points));
}

void FmuEquations::InitialStates(const ConstBlock& points, Block states) const {
  EvaluateMessage message;
  message.values = EvaluateMessage::Values::kInitialStates;
  const Eigen::ArrayXd numbers = points.col(0);
  const std::vector<int> rows(numbers.begin(), numbers.end());
  message.inputs.resize(points.rows(), std::ssize(description_.inputs));
  if (message.inputs.cols() > 0) {
    message.inputs = BlockInputs(specification_, inputs_, rows).At(0).matrix();
  }
  Evaluate(std::move(message), points, states);
}

void FmuEquations::Derivatives(double time_s, const ConstBlock& states, const ConstBlock& points,
                               const ConstBlock& inputs, Block derivatives) const {
  Evaluate({EvaluateMessage::Values::kDerivatives, time_s, {}, states.matrix(), inputs.matrix()},
           points, derivatives);
}

void FmuEquations::Outputs(double time_s, const ConstBlock& states, const ConstBlock& points,
                           const ConstBlock& inputs, Block outputs) const {
  Evaluate({EvaluateMessage::Values::kOutputs, time_s, {}, states.matrix(), inputs.matrix()},
           points, outputs);
}

void FmuEquations::Evaluate(EvaluateMessage message, const ConstBlock& points, Block values) const {
  values.setConstant(std::numeric_limits<double>::quiet_NaN());
  if (!status().ok() || points.rows() == 0) return;
  Worker& worker = *worker_of_[static_cast<size_t>(points(0, 0))];
  for (Eigen::Index row = 0; row < points.rows(); ++row) {
    const auto point = static_cast<size_t>(points(row, 0));
    POLYEST_CHECK(worker_of_[point] == &worker);
    message.points.push_back(row_of_[point]);
  }
  const std::lock_guard lock(worker.mutex);
  const absl::Status asked = Ask(worker, message, values);
  if (asked.ok()) return;
  worker.process.reset();
  const std::lock_guard lock_status(mutex_);
  ended_.Update(asked);
}

absl::Status FmuEquations::Ask(Worker& worker, const EvaluateMessage& message, Block values) const {
  const std::string& name = fmu_->description.interface.name;
  if (worker.process == nullptr) {
    POLYEST_ASSIGN_OR_RETURN(worker.process, WorkerProcess::Start(name, limits_));
    worker.process->Send(Encode(StartOf(*fmu_, specification_, worker.points)));
  }
  worker.process->Send(Encode(RequestMessage(message)));
  worker.process->AwaitAnswer();
  const std::array<WorkerProcess*, 1> processes = {worker.process.get()};
  POLYEST_RETURN_IF_ERROR(Converse(processes, stop_));
  POLYEST_ASSIGN_OR_RETURN(const ResultMessage result,
                           ReadResult(name, *worker.process, std::ssize(worker.points)));
  Note(worker, message, result.failures);
  if (values.cols() == 0) return absl::OkStatus();
  if (result.outputs.rows() != values.rows() || result.outputs.cols() != values.cols()) {
    return DamagedAnswer(name);
  }
  values = result.outputs.array();
  return absl::OkStatus();
}

void FmuEquations::Note(const Worker& worker, const EvaluateMessage& message,
                        const std::vector<PointFailure>& failures) const {
  const std::lock_guard lock(mutex_);
  const auto failure_of = [&](int row) -> std::string& {
    return failure_of_[static_cast<size_t>(worker.points[static_cast<size_t>(row)])];
  };
  for (const int row : message.points) failure_of(row).clear();
  for (const PointFailure& failure : failures) failure_of(failure.point) = failure.reason;
}

absl::Status FmuEquations::status() const {
  const std::lock_guard lock(mutex_);
  return ended_;
}

std::string FmuEquations::FailureOf(int point) const {
  const std::lock_guard lock(mutex_);
  return failure_of_[static_cast<size_t>(point)];
}

}  // namespace polyest::internal
