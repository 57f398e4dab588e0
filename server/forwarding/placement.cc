#include "server/forwarding/placement.h"

#include <algorithm>

namespace polyest::internal {
namespace {

// Time between two looks at the work of all. The daemons tell theirs once a second.
constexpr std::chrono::seconds kLook{1};
// A daemon that has not told for so long may be gone.
constexpr double kMayBeGoneS = 2;
// A daemon clearly has more to do than another if it uses so much more processor time, or has so
// many more sessions, at least, and this share of the mean number of sessions.
constexpr double kMoreCores = 0.5;
constexpr double kMoreSessions = 8;
constexpr double kMoreOfMean = 0.1;

double MeanSessions(const std::vector<JournalNode>& nodes) {
  double sum = 0;
  for (const JournalNode& node : nodes) sum += static_cast<double>(node.sessions);
  return sum / static_cast<double>(nodes.size());
}

}  // namespace

void Placement::Look() {
  if (looked_ && now_() - *looked_ < kLook) return;
  auto nodes = read_nodes_();
  // However long that took: others wait for it.
  looked_ = now_();
  nodes_ = nodes.ok() ? *std::move(nodes) : std::vector<JournalNode>();
  std::erase_if(nodes_, [this](const JournalNode& node) {
    if (node.number == here_) return false;
    return node.draining || node.address.empty() || node.lease_age_s > kMayBeGoneS;
  });
}

std::optional<std::string> Placement::Elsewhere() {
  const std::lock_guard lock(mutex_);
  Look();
  const auto here = std::find_if(nodes_.begin(), nodes_.end(),
                                 [this](const JournalNode& node) { return node.number == here_; });
  if (here == nodes_.end()) return std::nullopt;
  const double more_sessions = std::max(kMoreSessions, kMoreOfMean * MeanSessions(nodes_));
  const auto work = [&](const JournalNode& node) {
    return node.busy_cores / kMoreCores + static_cast<double>(node.sessions) / more_sessions;
  };
  const auto least = std::min_element(
      nodes_.begin(), nodes_.end(),
      [&](const JournalNode& a, const JournalNode& b) { return work(a) < work(b); });
  const bool stays = work(*here) - work(*least) < 1;
  ++(stays ? here : least)->sessions;
  return stays ? std::nullopt : std::optional(least->address);
}

}  // namespace polyest::internal
