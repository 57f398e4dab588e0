#pragma once

// Records which batches of a session are taken and which are kept, so that a stream can be resumed
// safely: batches are numbered 1, 2, 3 …, each is acknowledged once the journal keeps it, and any
// of them may be sent again and counts once.
//
// A batch is first taken (checked and handed to the estimator and to the journal), then kept. When
// the journal cannot keep a batch, this batch and all taken after it are lost: they count as never
// received. The estimator's state is then invalid until it is rebuilt from the kept batches.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "polyest/stop.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

// Thread-safe.
class BatchLedger {
 public:
  using Done = std::function<void(const absl::Status&)>;
  enum class Kind { kNext, kRepeat };

  explicit BatchLedger(const SessionPlace& kept) : kept_(kept), taken_(kept) {}

  // Return the place of the session after the last batch kept, and after the last batch taken.
  SessionPlace kept() const;
  SessionPlace taken() const;
  bool all_kept() const;
  // Returns how often batches that were taken could not be kept.
  uint64_t losses() const;

  // Tells whether a batch is the next one or a repeat, for a caller that has seen `losses` losses.
  // If there were more losses since, returns the reason of the last one, because `sequence` may
  // follow a lost batch and then says nothing. Otherwise refuses with FAILED_PRECONDITION, naming
  // the number expected, a number further ahead than the next; with INVALID_ARGUMENT a number below
  // 1; and with ALREADY_EXISTS the number of a batch with other content. `kept_digest` looks up the
  // digest of a kept batch; its errors are returned.
  absl::StatusOr<Kind> Check(
      int64_t sequence, const std::string& digest, uint64_t losses,
      const std::function<absl::StatusOr<std::string>(int64_t)>& kept_digest) const;

  // Takes the next batch, after which the session is at `place`. If there were more losses since
  // the caller saw `losses` of them, takes nothing and returns the reason of the last one.
  absl::Status Take(const SessionPlace& place, std::string digest, uint64_t losses);
  // Records whether the journal kept a batch that was taken after `losses` losses, and calls those
  // who wait for it. If it was not kept, it is lost with all batches taken after it. Does nothing
  // for a batch that is lost already.
  void Settle(uint64_t losses, int64_t sequence, const absl::Status& kept);
  // Goes on from another place that the journal has told. Batches under way are lost: the place
  // tells of those that are kept all the same. With `anew`, whoever has seen the losses until now
  // must begin anew, too, because what he holds lacks batches.
  void Restart(const SessionPlace& place, bool anew = false);
  // Restarts from the place if it is a later one and no batch is under way.
  void Follow(const SessionPlace& place, bool anew);
  // Calls `done` when every batch up to `sequence` is kept, at once if all are; with the reason
  // when one of them is lost. If there were more losses since the caller saw `losses` of them,
  // calls it with the reason of the last one, because another batch may have the number now.
  void WhenKept(int64_t sequence, uint64_t losses, Done done);
  // Waits until WhenKept would call, and returns what it would tell; gives up with the reason of
  // `stop`. Must not be called by the thread that settles batches.
  absl::Status AwaitKept(int64_t sequence, uint64_t losses, const Stop& stop);
  // Calls `done` when everything taken so far is kept, for a caller that has seen `losses` losses;
  // with the reason of the last loss if there were more since.
  void WhenAllKept(uint64_t losses, Done done);

 private:
  struct Taken {
    SessionPlace place;
    std::string digest;
  };

  // Called with the mutex held. Returns why those that wait have lost their batches.
  absl::Status RestartLocked(const SessionPlace& place, bool anew,
                             std::multimap<int64_t, Done>& lost);

  mutable std::mutex mutex_;
  SessionPlace kept_;
  SessionPlace taken_;
  std::deque<Taken> under_way_;
  std::multimap<int64_t, Done> waiting_;  // by the number of the batch waited for
  uint64_t losses_ = 0;
  absl::Status last_loss_;
};

}  // namespace polyest::internal
