#pragma once

// Keeps track of the open calls: no tenant takes the places or the memory of all, and the daemon
// can end them in order: first it refuses new ones, then the writers get their last estimates and
// end, then the watchers.

#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/service/stream_memory.h"

namespace polyest::internal {

// Is a stream that can be asked to end. Drain is called from any thread and must not wait.
class Drainable {
 public:
  virtual ~Drainable() = default;
  virtual void Drain() = 0;
};

class OpenCalls {
 public:
  enum class Kind { kUnary, kWriter, kWatcher };

  OpenCalls() = default;
  explicit OpenCalls(const StreamMemory::Limits& memory) : memory_(memory) {}

  // Weighs what the streams hold.
  StreamMemory& memory() { return memory_; }

  // Keeps a call open as long as it exists.
  class Ticket {
   public:
    Ticket(OpenCalls& calls, Kind kind, std::string tenant)
        : calls_(calls), kind_(kind), tenant_(std::move(tenant)) {}
    ~Ticket() { calls_.Leave(*this); }
    Ticket(const Ticket&) = delete;
    Ticket& operator=(const Ticket&) = delete;

    // Counts the bytes of an answer until the call leaves, which is when the client has read it.
    // RESOURCE_EXHAUSTED where the tenant's clients would leave more than kMaxUnreadBytes unread;
    // the answer must not be sent then. Never refuses the only answer, nor one of up to
    // kSmallAnswer bytes, as those are of most calls that change something. A call that changes
    // something and has a large answer holds the most that this may have before its work, and the
    // answer itself afterwards: the larger of both is counted, once.
    absl::Status HoldAnswer(int64_t bytes);

   private:
    friend class OpenCalls;

    OpenCalls& calls_;
    const Kind kind_;
    const std::string tenant_;
    int64_t answer_bytes_ = 0;
  };

  // Lets a call of a tenant in. UNAVAILABLE once the daemon shuts down; RESOURCE_EXHAUSTED while
  // kMaxStreams streams of the kind are open, or kMaxStreamsOfTenant of the tenant's, and for a
  // unary call while the tenant leaves answers of kMaxUnreadBytes unread.
  absl::StatusOr<std::unique_ptr<Ticket>> Enter(Kind kind, const std::string& tenant,
                                                std::weak_ptr<Drainable> stream = {});

  // Refuses new calls from here on, asks the streams to end and waits until all calls have left, or
  // until the deadline. Returns whether all have left.
  bool Drain(std::chrono::steady_clock::time_point deadline);

  // Returns the number of open calls of a kind.
  int Count(Kind kind) const;

  static constexpr int kMaxStreams = 10'000;
  static constexpr int kMaxStreamsOfTenant = kMaxStreams / 2;
  static constexpr int64_t kMaxUnreadBytes = 256 << 20;
  static constexpr int64_t kSmallAnswer = 4 << 10;

 private:
  static constexpr int kKinds = 3;

  // Counts the open calls of a tenant, and the bytes of its answers.
  struct Share {
    int open[kKinds] = {};
    int64_t answer_bytes = 0;
  };

  void Leave(const Ticket& ticket);
  // Returns why there is no room for a call. Called with the mutex held.
  absl::Status CheckMayEnter(Kind kind, const std::string& tenant) const;
  void DrainKind(Kind kind);
  int& open(Kind kind) { return open_[static_cast<int>(kind)]; }

  StreamMemory memory_;
  mutable std::mutex mutex_;
  std::condition_variable left_;
  bool draining_ = false;
  int open_[kKinds] = {};
  std::map<std::string, Share> shares_;  // of the tenants with open calls
  std::vector<std::weak_ptr<Drainable>> streams_[kKinds];
};

// Returns the refusal of a daemon that shuts down: UNAVAILABLE, with the time after which to try
// again.
absl::Status ShuttingDown();
// Returns why streams end whose session another daemon of the database takes: UNAVAILABLE likewise.
absl::Status Moving();

}  // namespace polyest::internal
