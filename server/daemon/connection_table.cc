#include "server/daemon/connection_table.h"

#include <sys/stat.h>

#include <vector>

namespace polyest::internal {
namespace {

// Shortest time between two looks at all connections, which take a few milliseconds when there are
// many.
constexpr std::chrono::milliseconds kBetweenSweeps{20};

// Returns the number of the socket that a descriptor leads to; 0 if it leads to none.
ino_t SocketOf(int descriptor) {
  struct stat status {};
  return fstat(descriptor, &status) == 0 && S_ISSOCK(status.st_mode) ? status.st_ino : 0;
}

}  // namespace

ConnectionTable::Verdict ConnectionTable::Admit(int descriptor, const std::string& peer,
                                                Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  // Its number is free again, so the connection that had it before is closed.
  Forget(descriptor);
  Verdict verdict = Look(peer);
  if (verdict != Verdict::kAdmitted && now - swept_ >= kBetweenSweeps) {
    swept_ = now;
    Sweep();
    verdict = Look(peer);
  }
  if (verdict != Verdict::kAdmitted) return verdict;
  open_[descriptor] = {SocketOf(descriptor), peer};
  ++of_peer_[peer];
  return verdict;
}

int64_t ConnectionTable::Count() {
  const std::lock_guard lock(mutex_);
  Sweep();
  return static_cast<int64_t>(open_.size());
}

ConnectionTable::Verdict ConnectionTable::Look(const std::string& peer) const {
  if (static_cast<int64_t>(open_.size()) >= limits_.total) return Verdict::kTooMany;
  const auto found = of_peer_.find(peer);
  return found != of_peer_.end() && found->second >= limits_.per_peer ? Verdict::kTooManyOfPeer
                                                                      : Verdict::kAdmitted;
}

void ConnectionTable::Sweep() {
  std::vector<int> closed;
  for (const auto& [descriptor, connection] : open_) {
    if (SocketOf(descriptor) != connection.socket) closed.push_back(descriptor);
  }
  for (const int descriptor : closed) Forget(descriptor);
}

void ConnectionTable::Forget(int descriptor) {
  const auto found = open_.find(descriptor);
  if (found == open_.end()) return;
  const auto peer = of_peer_.find(found->second.peer);
  if (--peer->second == 0) of_peer_.erase(peer);
  open_.erase(found);
}

}  // namespace polyest::internal
