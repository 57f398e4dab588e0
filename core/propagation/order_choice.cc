#include "core/propagation/order_choice.h"

#include <algorithm>

namespace polyest::internal {

bool OrderChoice::Accept(double step_s, bool is_whole) {
  ++steps_;
  duration_s_ += step_s;
  all_whole_ = all_whole_ && is_whole;
  if (steps_ != 0 && steps_ < kWindow) return false;
  const bool changes = steps_ == kWindow && Judge(static_cast<double>(evaluations_) / duration_s_);
  if (changes) {
    Change();
  } else {
    steps_ = 0;
  }
  evaluations_ = 0;
  duration_s_ = 0;
  all_whole_ = true;
  return changes;
}

// Returns whether to change the order after a window of that cost.
bool OrderChoice::Judge(double cost) {
  if (is_trial_) {
    is_trial_ = false;
    const bool better = cost < kBetter * other_cost_;
    pause_ = better ? kFirstPause : std::min(2 * pause_, kLongestPause);
    windows_to_trial_ = pause_;
    return !better;
  }
  if (windows_to_trial_ > 0) {
    --windows_to_trial_;
    return false;
  }
  if (!high_ && all_whole_) return false;
  is_trial_ = true;
  other_cost_ = cost;
  return true;
}

}  // namespace polyest::internal
