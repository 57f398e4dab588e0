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
                                 const RunCuts& cuts, const Stop& stop,
                                 v1::Measurements& measurements) {
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
    POLYEST_ASSIGN_OR_RETURN(Samples samples, ToSamples(batch.measurements, model));
    if (reorder) {
      POLYEST_ASSIGN_OR_RETURN(RowReorder::Step step, reorder->Next(samples));
      samples = step.released;
      reorder->Accept(std::move(step));
    }
    AppendRows(cuts.Keep(std::move(samples)), measurements);
    return absl::OkStatus();
  };
  POLYEST_RETURN_IF_ERROR(session.ReadBatches(0, append));
  return sequence;
}

}  // namespace polyest::internal
