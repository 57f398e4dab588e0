#include "server/sessions/session_export.h"

#include <utility>

#include "core/common/status.h"
#include "server/digest/digest.h"

namespace polyest::internal {
namespace {

// Size of one answer in bytes, so that a long session is not in memory all at once. An answer ends
// with the batch that passes this size.
constexpr size_t kBytes = 1 << 20;

}  // namespace

SessionExport::SessionExport(std::shared_ptr<const Session> session)
    : session_(std::move(session)), described_(session_->Describe()) {}

v1::SessionRecord SessionExport::Head(const v1::Problem& problem) const {
  v1::SessionRecord record;
  v1::SessionRecord::Head& head = *record.mutable_head();
  head.set_name(described_.name());
  head.set_problem(DeterministicBytes(problem));
  *head.mutable_create_time() = described_.create_time();
  head.set_batch_count(described_.last_sequence());
  head.set_reorder_window_s(described_.reorder_window_s());
  return record;
}

absl::Status SessionExport::AddHistory(std::vector<v1::SessionRecord>& records) const {
  POLYEST_ASSIGN_OR_RETURN(const auto history, session_->ReadHistory());
  for (const JournalHistoryPoint& point : history) {
    v1::SessionRecord record;
    record.mutable_past_estimate()->set_ordinal(point.ordinal);
    // One that cannot be read, or is of a later batch than those exported, is left out.
    if (point.sequence > described_.last_sequence() ||
        !record.mutable_past_estimate()->mutable_estimate()->ParseFromString(point.point)) {
      continue;
    }
    records.push_back(std::move(record));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<v1::SessionRecord>> SessionExport::Next() {
  std::vector<v1::SessionRecord> records;
  if (!std::exchange(begun_, true)) {
    POLYEST_ASSIGN_OR_RETURN(const v1::Problem problem, session_->ReadProblem());
    records.push_back(Head(problem));
  }
  size_t bytes = 0;
  const absl::Status full = absl::OutOfRangeError("enough for one answer");
  const absl::Status read =
      session_->ReadBatches(given_, [&](const JournalBatch& batch) -> absl::Status {
        if (bytes > kBytes || batch.sequence > described_.last_sequence()) return full;
        v1::SessionRecord::Batch& record = *records.emplace_back().mutable_batch();
        record.set_sequence(batch.sequence);
        *record.mutable_measurements() = batch.measurements;
        bytes += batch.measurements.ByteSizeLong();
        given_ = batch.sequence;
        return absl::OkStatus();
      });
  if (!read.ok() && read != full) return read;
  const bool complete = given_ == described_.last_sequence();
  if (complete && !std::exchange(ended_, true)) {
    POLYEST_RETURN_IF_ERROR(AddHistory(records));
    records.emplace_back().mutable_end();
  }
  return records;
}

}  // namespace polyest::internal
