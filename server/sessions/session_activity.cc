#include "server/sessions/session_activity.h"

#include <algorithm>

namespace polyest::internal {

void SessionActivity::OnLoaded(int64_t sequence, double measured_s) {
  const std::lock_guard lock(mutex_);
  processed_ = sequence;
  measured_before_s_ = measured_s;
  measured_s_ = computed_s_ = 0;
}

void SessionActivity::OnUnloaded() {
  const std::lock_guard lock(mutex_);
  processed_.reset();
  measured_s_ = computed_s_ = 0;
}

void SessionActivity::OnComputing() {
  const std::lock_guard lock(mutex_);
  computing_ = true;
}

void SessionActivity::OnComputed(Clock::duration spent, int64_t sequence, double measured_s) {
  const double spent_s = std::chrono::duration<double>(spent).count();
  const std::lock_guard lock(mutex_);
  computing_ = false;
  compute_s_ += spent_s;
  computed_s_ += spent_s;
  measured_s_ = measured_s - measured_before_s_;
  processed_ = sequence;
  last_use_ = Clock::now();
}

int64_t SessionActivity::OnEstimate(int64_t reexpansions) {
  const std::lock_guard lock(mutex_);
  const int64_t added = std::max<int64_t>(0, reexpansions - reexpansions_);
  ++estimates_;
  reexpansions_ = reexpansions;
  return added;
}

void SessionActivity::OnUsed() {
  const std::lock_guard lock(mutex_);
  last_use_ = Clock::now();
}

bool SessionActivity::computing() const {
  const std::lock_guard lock(mutex_);
  return computing_;
}

SessionActivity::Clock::duration SessionActivity::idle() const {
  const std::lock_guard lock(mutex_);
  return Clock::now() - last_use_;
}

SessionActivity::Summary SessionActivity::Summarize() const {
  const std::lock_guard lock(mutex_);
  Summary summary;
  summary.estimates = estimates_;
  summary.reexpansions = reexpansions_;
  summary.compute_s = compute_s_;
  summary.sequence = processed_;
  if (measured_s_ > 0) summary.real_time_factor = measured_s_ / computed_s_;
  return summary;
}

}  // namespace polyest::internal
