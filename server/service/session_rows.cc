#include "server/service/session_rows.h"

#include <optional>
#include <utility>

#include "core/common/status.h"
#include "core/estimator/record/sample_checks.h"
#include "proto/wire/convert/measurements.h"
#include "server/sessions/loaded_session.h"
#include "server/sessions/row_reorder.h"

namespace polyest::internal {
namespace {

// The rows as a message, as the samples made of it, and as the study keeps them.
constexpr int64_t kCopies = 3;

}  // namespace

absl::StatusOr<int64_t> ReadRows(const Session& session, const ResolvedProblem& problem,
                                 const Stop& stop, v1::Measurements& measurements) {
  POLYEST_RETURN_IF_ERROR(
      session.CheckMemory(kCopies * session.place().rows * LoadedSession::RowBytes(problem)));
  const Model& model = *problem.problem().model;
  std::optional<RowReorder> reorder;
  if (session.reorder_window_s() > 0) {
    reorder.emplace(SampleChecks(problem).names(), session.reorder_window_s());
  }
  int64_t sequence = 0;
  const auto append = [&](const JournalBatch& batch) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    sequence = batch.sequence;
    if (reorder) {
      POLYEST_ASSIGN_OR_RETURN(const Samples samples, ToSamples(batch.measurements, model));
      POLYEST_ASSIGN_OR_RETURN(RowReorder::Step step, reorder->Next(samples));
      AppendRows(step.released, measurements);
      reorder->Accept(std::move(step));
      return absl::OkStatus();
    }
    // Each batch may have units of its own.
    v1::Measurements converted = batch.measurements;
    POLYEST_RETURN_IF_ERROR(ToModelUnits(model, converted));
    AppendRows(converted, measurements);
    return absl::OkStatus();
  };
  POLYEST_RETURN_IF_ERROR(session.ReadBatches(0, append));
  return sequence;
}

}  // namespace polyest::internal
