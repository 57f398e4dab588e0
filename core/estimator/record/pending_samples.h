#pragma once

#include <absl/status/status.h>

#include <span>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/propagation/filter_bank.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns the outputs asked for and, behind them, the measured ones.
std::vector<int> AskedAndMeasured(const ResolvedProblem& problem, std::vector<int> outputs);

// Samples that filters have not taken yet.
class PendingSamples {
 public:
  // Holds samples of `channels` outputs, behind `before` others of the filters that are not
  // measured.
  PendingSamples(Eigen::Index before, Eigen::Index channels)
      : before_(before), channels_(channels) {}

  // Adds the samples at a time, NaN where there is none, and the standard deviations of their
  // noise; both may be empty.
  void Add(double time_s, std::span<const double> samples, std::span<const double> noise);
  bool empty() const { return times_s_.empty(); }
  double last_time_s() const { return times_s_.back(); }
  // Lets the filters take them.
  absl::Status Give(FilterBank& filters, const Stop& stop);

 private:
  const Eigen::Index before_, channels_;
  std::vector<double> times_s_, values_, noise_;
};

}  // namespace polyest::internal
