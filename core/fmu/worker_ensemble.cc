#include "core/fmu/worker_ensemble.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/fmu/conversation.h"

namespace polyest::internal {
namespace {

// Returns the signal's specification with a table's knots restored.
InputSpecification Specification(const InputSignal& signal) {
  InputSpecification specification = signal.specification();
  if (auto* table = std::get_if<TableInput>(&specification)) {
    table->time_s.assign(signal.knot_times_s().begin(), signal.knot_times_s().end());
    table->value.assign(signal.knot_values().begin(), signal.knot_values().end());
  }
  return specification;
}

// The number of workers in this process that hold one trajectory each.
std::atomic<int> of_one_trajectory = 0;

// Whether a process can hold one trajectory only.
bool HoldsOneTrajectory(const FmuInterface& interface) {
  return interface.once_per_process && !interface.can_save_state;
}

// Whether each trajectory is simulated on its own (PointwiseEnsemble).
bool IsPointwise(const FmuInterface& interface) {
  return interface.kind == FmuKind::kCoSimulation || interface.event_indicators > 0 ||
         interface.needs_completed_step;
}

}  // namespace

WorkerEnsemble::WorkerEnsemble(std::shared_ptr<const UnpackedFmu> fmu,
                               EnsembleSpecification specification, const InputSignals* inputs,
                               const WorkerLimits& limits)
    : fmu_(std::move(fmu)),
      specification_(std::move(specification)),
      inputs_(inputs),
      limits_(limits),
      knots_sent_(inputs->size(), 0) {}

WorkerEnsemble::~WorkerEnsemble() { of_one_trajectory -= reserved_; }

absl::Status WorkerEnsemble::Reserve(int workers) {
  const int before = of_one_trajectory.fetch_add(workers);
  reserved_ = workers;
  if (before + workers <= kMaxOfOneTrajectory) return absl::OkStatus();
  of_one_trajectory -= workers;
  reserved_ = 0;
  return absl::ResourceExhaustedError(absl::StrFormat(
      "fmu %s: it can be instantiated only once per process and cannot save its state, so that its "
      "%d trajectories need as many processes; there may be %d of that kind, and %d are in use",
      fmu_->description.interface.name, workers, kMaxOfOneTrajectory, before));
}

absl::Status WorkerEnsemble::StartWorkers() {
  const FmuInterface& interface = fmu_->description.interface;
  const bool alone = HoldsOneTrajectory(interface);
  if (alone && reserved_ == 0) POLYEST_RETURN_IF_ERROR(Reserve(points()));
  const int block_size = alone || IsPointwise(interface) ? 1 : kPointsOfBlock;
  const int blocks = (points() + block_size - 1) / block_size;
  const int count = alone ? blocks : std::max(1, std::min(specification_.threads, blocks));
  std::vector<Worker> workers(static_cast<size_t>(count));
  for (size_t w = 0; w < workers.size(); ++w) {
    std::vector<int> block_points;
    for (int block = static_cast<int>(w); block < blocks; block += count) {
      const int first = block * block_size;
      block_points.push_back(std::min(block_size, points() - first));
      for (int i = 0; i < block_points.back(); ++i) workers[w].rows.push_back(first + i);
    }
    POLYEST_ASSIGN_OR_RETURN(workers[w].process, WorkerProcess::Start(interface.name, limits_));
    workers[w].process->Send(Encode(MakeStart(block_points, workers[w].rows)));
  }
  workers_ = std::move(workers);
  return absl::OkStatus();
}

StartMessage WorkerEnsemble::MakeStart(const std::vector<int>& block_points,
                                       const std::vector<int>& rows) const {
  StartMessage start = StartOf(*fmu_, specification_, rows);
  start.block_points = block_points;
  start.amplitudes = RowsOf(specification_.amplitudes, rows);
  start.input_delays_s = RowsOf(specification_.input_delays_s, rows);
  start.input_offsets = RowsOf(specification_.input_offsets, rows);
  for (const InputSignal& signal : *inputs_) start.signals.push_back(Specification(signal));
  return start;
}

AdvanceMessage WorkerEnsemble::MakeAdvance(std::span<const double> times_s) {
  AdvanceMessage advance;
  for (size_t i = 0; i < inputs_->size(); ++i) {
    const InputSignal& signal = (*inputs_)[i];
    if (!signal.streamed()) continue;
    const auto times = signal.knot_times_s().subspan(knots_sent_[i]);
    const auto values = signal.knot_values().subspan(knots_sent_[i]);
    advance.knots.push_back({static_cast<int>(i),
                             {times.begin(), times.end()},
                             {values.begin(), values.end()},
                             signal.finished()});
    knots_sent_[i] += times.size();
  }
  advance.times_s.assign(times_s.begin(), times_s.end());
  return advance;
}

absl::Status WorkerEnsemble::Advance(std::span<const double> times_s, MatrixRef outputs,
                                     const Stop& stop) {
  POLYEST_CHECK(outputs.rows() == points());
  POLYEST_CHECK(outputs.cols() == std::ssize(times_s) * std::ssize(specification_.outputs));
  POLYEST_RETURN_IF_ERROR(stop.Check());
  POLYEST_RETURN_IF_ERROR(fmu_->status);
  if (points() == 0) return absl::OkStatus();
  if (workers_.empty()) POLYEST_RETURN_IF_ERROR(StartWorkers());
  const std::string message = Encode(RequestMessage(MakeAdvance(times_s)));
  const auto together = static_cast<size_t>(std::max(1, specification_.threads));
  for (std::span<Worker> rest = workers_; !rest.empty();) {
    const size_t count = std::min(together, rest.size());
    const absl::Status status = AdvanceTogether(rest.first(count), message, outputs, stop);
    if (!status.ok()) {
      KillAll();
      return status;
    }
    rest = rest.subspan(count);
  }
  failures_.clear();
  for (const Worker& worker : workers_) {
    failures_.insert(failures_.end(), worker.failures.begin(), worker.failures.end());
  }
  std::sort(failures_.begin(), failures_.end(),
            [](const PointFailure& a, const PointFailure& b) { return a.point < b.point; });
  return absl::OkStatus();
}

absl::Status WorkerEnsemble::AdvanceTogether(std::span<Worker> workers, const std::string& message,
                                             MatrixRef outputs, const Stop& stop) {
  std::vector<WorkerProcess*> processes;
  for (Worker& worker : workers) {
    worker.process->Send(message);
    worker.process->AwaitAnswer();
    processes.push_back(worker.process.get());
  }
  POLYEST_RETURN_IF_ERROR(Converse(processes, stop));
  for (Worker& worker : workers) POLYEST_RETURN_IF_ERROR(TakeResult(worker, outputs));
  return absl::OkStatus();
}

absl::Status WorkerEnsemble::TakeResult(Worker& worker, MatrixRef outputs) {
  const std::string& name = fmu_->description.interface.name;
  const auto rows = static_cast<Eigen::Index>(worker.rows.size());
  POLYEST_ASSIGN_OR_RETURN(ResultMessage result, ReadResult(name, *worker.process, rows));
  if (outputs.cols() > 0) {
    if (result.outputs.rows() != rows || result.outputs.cols() != outputs.cols()) {
      return DamagedAnswer(name);
    }
    for (Eigen::Index i = 0; i < rows; ++i) {
      outputs.row(worker.rows[static_cast<size_t>(i)]) = result.outputs.row(i);
    }
  }
  for (PointFailure& failure : result.failures) {
    failure.point = worker.rows[static_cast<size_t>(failure.point)];
  }
  worker.failures = std::move(result.failures);
  return absl::OkStatus();
}

void WorkerEnsemble::KillAll() {
  for (Worker& worker : workers_) worker.process->Kill();
}

}  // namespace polyest::internal
