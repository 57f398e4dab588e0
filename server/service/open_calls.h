#pragma once

// Which calls are open, so that the daemon can end them in order: first no new ones, then the
// writers' last estimates, then the watchers.

#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

namespace polyest::internal {

// A stream that can be asked to come to its end. Called from any thread; must not wait.
class Drainable {
 public:
  virtual ~Drainable() = default;
  virtual void Drain() = 0;
};

class OpenCalls {
 public:
  enum class Kind { kUnary, kWriter, kWatcher };

  // Holding it keeps a call open.
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

  // UNAVAILABLE once the daemon shuts down; RESOURCE_EXHAUSTED past kMaxStreams of a kind.
  absl::StatusOr<std::unique_ptr<Ticket>> Enter(Kind kind, std::weak_ptr<Drainable> stream = {});

  // Refuses new calls from here on, asks the streams to end and waits until all calls have left, or
  // until the deadline.
  void Drain(std::chrono::steady_clock::time_point deadline);

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

absl::Status ShuttingDown();

}  // namespace polyest::internal
