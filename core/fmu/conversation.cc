#include "core/fmu/conversation.h"

#include <absl/strings/str_cat.h>
#include <poll.h>

#include <algorithm>
#include <array>

#include "core/common/status.h"
#include "core/external/clean_text.h"

namespace polyest::internal {
namespace {

// Interval between two checks of the stop request and of the workers' progress.
constexpr int kLookMs = 20;
// A worker's error is one of the model (FailedPrecondition) or of its surroundings, which says
// nothing of the parameters that it was computed for.
constexpr std::array kCodesOfWorkers = {
    absl::StatusCode::kOk, absl::StatusCode::kFailedPrecondition, absl::StatusCode::kUnavailable,
    absl::StatusCode::kResourceExhausted, absl::StatusCode::kInternal};

}  // namespace

Matrix RowsOf(const Matrix& matrix, const std::vector<int>& rows) {
  return matrix.rows() == 0 ? Matrix() : Matrix(matrix(rows, Eigen::all));
}

StartMessage StartOf(const UnpackedFmu& fmu, const EnsembleSpecification& specification,
                     const std::vector<int>& rows) {
  const FmuDescription& description = fmu.description;
  StartMessage start;
  const std::filesystem::path& folder = fmu.folder->path();
  start.library = (folder / LibraryPath(description.interface)).string();
  start.resources = (folder / "resources").string();
  start.interface = description.interface;
  start.parameters = description.parameters;
  start.inputs = description.inputs;
  for (const int output : specification.outputs) {
    start.outputs.push_back(description.outputs[static_cast<size_t>(output)]);
  }
  start.parameter_values = RowsOf(specification.parameters, rows);
  start.integration = specification.integration;
  return start;
}

absl::Status Converse(std::span<WorkerProcess* const> workers, const Stop& stop) {
  for (;;) {
    std::vector<pollfd> waiting;
    for (WorkerProcess* const worker : workers) {
      if (!worker->awaits_answer()) continue;
      POLYEST_RETURN_IF_ERROR(worker->Exchange());
      if (!worker->awaits_answer()) continue;
      const int events = POLLIN | (worker->has_to_send() ? POLLOUT : 0);
      waiting.push_back({worker->socket(), static_cast<short>(events), 0});
    }
    if (waiting.empty()) return absl::OkStatus();
    POLYEST_RETURN_IF_ERROR(stop.Check());
    poll(waiting.data(), waiting.size(), kLookMs);
  }
}

absl::Status DamagedAnswer(const std::string& fmu) {
  return absl::FailedPreconditionError(
      absl::StrCat("fmu ", fmu, ": its worker's answer is damaged"));
}

absl::StatusOr<ResultMessage> ReadResult(const std::string& fmu, WorkerProcess& worker,
                                         Eigen::Index rows) {
  Decoder decoder(worker.TakeAnswer());
  ResultMessage result;
  decoder(result);
  bool sound = decoder.complete();
  for (PointFailure& failure : result.failures) {
    sound = sound && failure.point >= 0 && failure.point < rows;
    failure.reason = CleanText(failure.reason);
  }
  const auto code = static_cast<absl::StatusCode>(result.code);
  if (!sound || std::ranges::find(kCodesOfWorkers, code) == kCodesOfWorkers.end())
    return DamagedAnswer(fmu);
  if (code == absl::StatusCode::kOk) return result;
  return absl::Status(code, absl::StrCat("fmu ", fmu, ": ", CleanText(result.error)));
}

}  // namespace polyest::internal
