#pragma once

// Keeps track of the open calls, so that the daemon can end them in order: first it refuses new
// ones, then the writers get their last estimates and end, then the watchers.

#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

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

  // Keeps a call open as long as it exists.
  class Ticket {
   public:
    Ticket(OpenCalls& calls, Kind kind) : calls_(calls), kind_(kind) {}
    ~Ticket() { calls_.Leave(kind_); }
    Ticket(const Ticket&) = delete;
    Ticket& operator=(const Ticket&) = delete;

   private:
    OpenCalls& calls_;
    const Kind kind_;
  };

  // Lets a call in. UNAVAILABLE once the daemon shuts down; RESOURCE_EXHAUSTED while kMaxStreams
  // streams of the kind are open.
  absl::StatusOr<std::unique_ptr<Ticket>> Enter(Kind kind, std::weak_ptr<Drainable> stream = {});

  // Refuses new calls from here on, asks the streams to end and waits until all calls have left, or
  // until the deadline.
  void Drain(std::chrono::steady_clock::time_point deadline);

  // Returns the number of open calls of a kind.
  int Count(Kind kind) const;

  static constexpr int kMaxStreams = 10'000;

 private:
  static constexpr int kKinds = 3;

  void Leave(Kind kind);
  void DrainKind(Kind kind);
  int& open(Kind kind) { return open_[static_cast<int>(kind)]; }

  mutable std::mutex mutex_;
  std::condition_variable left_;
  bool draining_ = false;
  int open_[kKinds] = {};
  std::vector<std::weak_ptr<Drainable>> streams_[kKinds];
};

// Returns the refusal of a daemon that shuts down: UNAVAILABLE, with the time after which to try
// again.
absl::Status ShuttingDown();

}  // namespace polyest::internal
