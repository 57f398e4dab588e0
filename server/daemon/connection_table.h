#pragma once

// Counts the connections that were handed to gRPC, which does not tell when it closes one: a
// descriptor belongs to the same connection as long as it leads to the same socket.

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>

namespace polyest::internal {

struct ConnectionLimits {
  int64_t total = 10'000;
  int64_t per_peer = 5'000;
};

// Thread-safe.
class ConnectionTable {
 public:
  using Clock = std::chrono::steady_clock;

  enum class Verdict { kAdmitted, kTooMany, kTooManyOfPeer };

  explicit ConnectionTable(ConnectionLimits limits) : limits_(limits) {}

  // Counts a new connection of a peer if there is room for it. `now` must not decrease.
  Verdict Admit(int descriptor, const std::string& peer, Clock::time_point now = Clock::now());
  // Returns the number of connections that are open.
  int64_t Count();

 private:
  struct Connection {
    ino_t socket = 0;  // that the descriptor led to
    std::string peer;
  };

  // The following are called with the mutex held.
  void Sweep();
  void Forget(int descriptor);
  Verdict Look(const std::string& peer) const;

  const ConnectionLimits limits_;
  std::mutex mutex_;
  std::unordered_map<int, Connection> open_;  // by descriptor
  std::unordered_map<std::string, int64_t> of_peer_;
  Clock::time_point swept_{};
};

}  // namespace polyest::internal
