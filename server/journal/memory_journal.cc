#include "server/journal/memory_journal.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "server/digest/digest.h"

namespace polyest::internal {

absl::StatusOr<const MemoryJournal::Kept*> MemoryJournal::Find(int64_t session) const {
  const auto found = sessions_.find(session);
  if (found == sessions_.end()) return NoSuchSession();
  return &found->second;
}

absl::StatusOr<std::vector<SessionHead>> MemoryJournal::Heads() const {
  std::vector<SessionHead> heads;
  const std::lock_guard lock(mutex_);
  for (const auto& [number, kept] : sessions_) {
    if (kept.hidden) continue;
    SessionHead& head = heads.emplace_back(kept.head);
    head.bytes = static_cast<int64_t>(DeterministicBytes(kept.problem).size());
    for (const JournalEntry& batch : kept.batches) {
      head.bytes += static_cast<int64_t>(batch.measurements.size());
    }
    if (kept.snapshot) head.snapshot_bytes = static_cast<int64_t>(kept.snapshot->state.size());
  }
  std::sort(heads.begin(), heads.end(), [](const SessionHead& a, const SessionHead& b) {
    return std::tie(a.tenant, a.name) < std::tie(b.tenant, b.name);
  });
  return heads;
}

absl::Status MemoryJournal::CheckFree(const SessionHead& head) const {
  const bool taken = std::any_of(sessions_.begin(), sessions_.end(), [&](const auto& one) {
    const Kept& kept = one.second;
    return !kept.hidden && kept.head.tenant == head.tenant && kept.head.name == head.name;
  });
  if (!taken) return absl::OkStatus();
  return absl::AlreadyExistsError("the journal has a session of that name");
}

absl::StatusOr<int64_t> MemoryJournal::Create(const SessionHead& head, const v1::Problem& problem,
                                              bool hidden) {
  const std::lock_guard lock(mutex_);
  if (!hidden) POLYEST_RETURN_IF_ERROR(CheckFree(head));
  Kept kept;
  kept.head = head;
  kept.head.number = ++last_number_;
  kept.head.place = {};
  kept.hidden = hidden;
  kept.problem = problem;
  sessions_.emplace(last_number_, std::move(kept));
  return last_number_;
}

absl::Status MemoryJournal::Show(int64_t session) {
  const std::lock_guard lock(mutex_);
  POLYEST_ASSIGN_OR_RETURN(const Kept* const kept, Find(session));
  if (!kept->hidden) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(CheckFree(kept->head));
  sessions_[session].hidden = false;
  return absl::OkStatus();
}

absl::Status MemoryJournal::Delete(int64_t session) {
  const std::lock_guard lock(mutex_);
  POLYEST_RETURN_IF_ERROR(Find(session).status());
  sessions_.erase(session);
  return absl::OkStatus();
}

absl::Status MemoryJournal::Keep(JournalEntry entry) {
  POLYEST_RETURN_IF_ERROR(Find(entry.session).status());
  Kept& kept = sessions_[entry.session];
  if (entry.place.sequence != kept.head.place.sequence + 1) {
    return absl::FailedPreconditionError(
        absl::StrFormat("batch %d does not follow what the journal has", entry.place.sequence));
  }
  kept.batches.push_back(std::move(entry));
  kept.head.place = kept.batches.back().place;
  return absl::OkStatus();
}

void MemoryJournal::Append(JournalEntry entry, Done done) {
  absl::Status kept;
  {
    const std::lock_guard lock(mutex_);
    kept = Keep(std::move(entry));
  }
  done(kept);
}

void MemoryJournal::SaveSnapshot(int64_t session, JournalSnapshot snapshot) {
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find(session);
  if (found == sessions_.end() || found->second.head.place.sequence < snapshot.sequence) return;
  found->second.snapshot = std::move(snapshot);
}

void MemoryJournal::SaveHistoryPoint(int64_t session, JournalHistoryPoint point, int64_t stride) {
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find(session);
  if (found == sessions_.end() || found->second.head.place.sequence < point.sequence) return;
  std::vector<JournalHistoryPoint>& history = found->second.history;
  history.push_back(std::move(point));
  std::erase_if(history, [&](const JournalHistoryPoint& one) { return one.ordinal % stride != 0; });
}

absl::StatusOr<v1::Problem> MemoryJournal::ReadProblem(int64_t session) const {
  const std::lock_guard lock(mutex_);
  POLYEST_ASSIGN_OR_RETURN(const Kept* const kept, Find(session));
  return kept->problem;
}

absl::Status MemoryJournal::ReadBatches(
    int64_t session, int64_t after,
    const std::function<absl::Status(const JournalBatch&)>& take) const {
  for (JournalBatch batch{after + 1, {}};; ++batch.sequence) {
    {
      const std::lock_guard lock(mutex_);
      POLYEST_ASSIGN_OR_RETURN(const Kept* const kept, Find(session));
      if (batch.sequence > kept->head.place.sequence) return absl::OkStatus();
      const JournalEntry& entry = kept->batches[static_cast<size_t>(batch.sequence - 1)];
      POLYEST_CHECK(batch.measurements.ParseFromString(entry.measurements));
    }
    POLYEST_RETURN_IF_ERROR(take(batch));
  }
}

absl::StatusOr<std::string> MemoryJournal::ReadDigest(int64_t session, int64_t sequence) const {
  const std::lock_guard lock(mutex_);
  POLYEST_ASSIGN_OR_RETURN(const Kept* const kept, Find(session));
  if (sequence < 1 || sequence > kept->head.place.sequence) {
    return absl::NotFoundError("the journal has no such batch");
  }
  return kept->batches[static_cast<size_t>(sequence - 1)].digest;
}

absl::StatusOr<std::optional<JournalSnapshot>> MemoryJournal::ReadSnapshot(int64_t session) const {
  const std::lock_guard lock(mutex_);
  POLYEST_ASSIGN_OR_RETURN(const Kept* const kept, Find(session));
  return kept->snapshot;
}

absl::StatusOr<std::vector<JournalHistoryPoint>> MemoryJournal::ReadHistory(int64_t session) const {
  const std::lock_guard lock(mutex_);
  POLYEST_ASSIGN_OR_RETURN(const Kept* const kept, Find(session));
  return kept->history;
}

}  // namespace polyest::internal
