#pragma once

// Chooses the daemon for a new session among those that share a database: the one with the least
// work, unless this one hardly has more.

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/journal/session_journal.h"

namespace polyest::internal {

// Thread-safe.
class Placement {
 public:
  using Clock = std::chrono::steady_clock;

  using ReadNodes = std::function<absl::StatusOr<std::vector<JournalNode>>()>;

  // `here` is the number of this daemon; `read_nodes` returns what SharedJournal::Nodes does.
  Placement(int64_t here, ReadNodes read_nodes, std::function<Clock::time_point()> now = Clock::now)
      : here_(here), read_nodes_(std::move(read_nodes)), now_(std::move(now)) {}

  // Returns the address of the daemon that is to have a new session, and counts the session there.
  // Returns nothing if that daemon is this one, or if the journal cannot be read. Reads the journal
  // at most once a second.
  std::optional<std::string> Elsewhere();

 private:
  void Look();

  const int64_t here_;
  const ReadNodes read_nodes_;
  const std::function<Clock::time_point()> now_;
  std::mutex mutex_;
  std::optional<Clock::time_point> looked_;
  std::vector<JournalNode> nodes_;  // that take sessions
};

}  // namespace polyest::internal
