#pragma once

// The rule that makes a stream safe to resume: batches are numbered 1, 2, 3 …, each is acknowledged
// once the journal keeps it, and any of them may be sent again and counts once.
//
// A batch is first taken (checked and handed to the estimator and to the journal), then kept. When
// the journal cannot keep one, that one and all taken after it are as if they had never come; what
// the estimator holds is then void, until it is made anew from what is kept.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "server/journal/session_journal.h"

namespace polyest::internal {

// Threads may share it.
class BatchLedger {
 public:
  using Done = std::function<void(const absl::Status&)>;
  enum class Kind { kNext, kRepeat };

  explicit BatchLedger(const SessionPlace& kept) : kept_(kept), taken_(kept) {}

  SessionPlace kept() const;
  SessionPlace taken() const;
  bool all_kept() const;
  // Counts the times that taken batches were not kept.
  uint64_t losses() const;

  // Says what a batch is to who has seen `losses` of them. When taken batches were lost since, the
  // answer is why: the number may then follow one of those and says nothing. Otherwise
  // FAILED_PRECONDITION, naming the number expected, for a number further ahead than the next;
  // INVALID_ARGUMENT for one below 1; ALREADY_EXISTS for the number of another batch.
  // `kept_digest` looks up that of a batch that is kept.
  absl::StatusOr<Kind> Check(
      int64_t sequence, const std::string& digest, uint64_t losses,
      const std::function<absl::StatusOr<std::string>(int64_t)>& kept_digest) const;

  // Takes the next batch, which leads to `place`. When taken batches were lost since `losses` of
  // them were seen, takes nothing and answers why they were lost.
  absl::Status Take(const SessionPlace& place, std::string digest, uint64_t losses);
  // What became of a batch taken after that many losses.
  void Settle(uint64_t losses, int64_t sequence, const absl::Status& kept);
  // Calls `done` when every batch up to this one is kept, at once if they are; with the reason when
  // one of them is not.
  void WhenKept(int64_t sequence, Done done);
  // The same of everything taken, for who has seen `losses` before: with the reason when there were
  // more since.
  void WhenAllKept(uint64_t losses, Done done);

 private:
  struct Taken {
    SessionPlace place;
    std::string digest;
  };

  mutable std::mutex mutex_;
  SessionPlace kept_;
  SessionPlace taken_;
  std::deque<Taken> under_way_;
  std::multimap<int64_t, Done> waiting_;  // by the sequence waited for
  uint64_t losses_ = 0;
  absl::Status last_loss_;
};

}  // namespace polyest::internal
