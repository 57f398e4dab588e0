#pragma once

// Keeps sessions in memory; they end with the process.

#include <map>
#include <mutex>
#include <vector>

#include "server/journal/session_journal.h"

namespace polyest::internal {

class MemoryJournal final : public SessionJournal {
 public:
  bool durable() const override { return false; }
  absl::StatusOr<std::vector<SessionHead>> Heads() const override;
  absl::StatusOr<int64_t> Create(const SessionHead& head, const v1::Problem& problem,
                                 bool hidden) override;
  absl::Status Show(int64_t session) override;
  absl::Status Delete(int64_t session) override;
  void Append(JournalEntry entry, Done done) override;
  void SaveSnapshot(int64_t session, JournalSnapshot snapshot) override;
  void SaveHistoryPoint(int64_t session, JournalHistoryPoint point, int64_t stride) override;
  absl::StatusOr<v1::Problem> ReadProblem(int64_t session) const override;
  absl::Status ReadBatches(
      int64_t session, int64_t after,
      const std::function<absl::Status(const JournalBatch&)>& take) const override;
  absl::StatusOr<std::string> ReadDigest(int64_t session, int64_t sequence) const override;
  absl::StatusOr<std::optional<JournalSnapshot>> ReadSnapshot(int64_t session) const override;
  absl::StatusOr<std::vector<JournalHistoryPoint>> ReadHistory(int64_t session) const override;

 private:
  struct Kept {
    SessionHead head;
    bool hidden = false;
    v1::Problem problem;
    std::vector<JournalEntry> batches;
    std::optional<JournalSnapshot> snapshot;
    std::vector<JournalHistoryPoint> history;
  };

  // The following are called with the mutex held.
  absl::StatusOr<const Kept*> Find(int64_t session) const;
  absl::Status CheckFree(const SessionHead& head) const;
  absl::Status Keep(JournalEntry entry);

  mutable std::mutex mutex_;
  std::map<int64_t, Kept> sessions_;
  int64_t last_number_ = 0;
};

}  // namespace polyest::internal
