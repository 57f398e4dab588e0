#pragma once

// Chooses between two methods of integration of different order by what they cost. High order takes
// long steps where the derivatives are smooth; where samples at which steps must end, or kinks of
// the derivatives, keep steps short, low order needs fewer evaluations. Which is so is counted:
// from time to time the other method is tried for some steps, and the one that needs fewer
// evaluations for each second goes on. Nothing here depends on the time that anything takes.

#include <cstdint>

namespace polyest::internal {

class OrderChoice {
 public:
  bool high() const { return high_; }
  // Counts evaluations of the derivatives, also those of steps that were rejected.
  void CountEvaluations(int evaluations) { evaluations_ += evaluations; }
  // Takes note of an accepted step. `is_whole`: it led from one stop to the next, so that low order
  // cannot do better. Returns whether the next step is to be of the other order.
  bool Accept(double step_s, bool is_whole);

 private:
  static constexpr int kSettling = 4;  // steps after a change that do not count
  static constexpr int kWindow = 12;   // steps that do
  static constexpr int kFirstPause = 16, kLongestPause = 1024;  // windows between trials
  static constexpr double kBetter = 0.95;

  bool Judge(double cost);
  void Change() {
    high_ = !high_;
    steps_ = -kSettling;
  }

  bool high_ = false;
  bool is_trial_ = false;
  int steps_ = 0;  // of this window
  int64_t evaluations_ = 0;
  double duration_s_ = 0;
  bool all_whole_ = true;
  double other_cost_ = 0;  // evaluations for each second with the other order, during a trial
  int pause_ = kFirstPause, windows_to_trial_ = 0;
};

}  // namespace polyest::internal
