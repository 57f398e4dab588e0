#include "server/service/session_rows.h"

#include "core/common/status.h"
#include "proto/wire/convert/measurements.h"
#include "server/sessions/batch_replay.h"
#include "server/sessions/loaded_session.h"

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
  BatchReplay replay(problem, session.reorder_window_s(), cuts);
  int64_t sequence = 0;
  const auto append = [&](const JournalBatch& batch) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    sequence = batch.sequence;
    POLYEST_ASSIGN_OR_RETURN(const Samples samples, replay.Next(batch.measurements));
    AppendRows(samples, measurements);
    return absl::OkStatus();
  };
  POLYEST_RETURN_IF_ERROR(session.ReadBatches(0, append));
  return sequence;
}

}  // namespace polyest::internal
