#pragma once

// The quantities that a problem holds fixed and that could be uncertain instead.

#include <optional>
#include <string>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

struct FixedQuantity {
  static constexpr int kNoChannel = -1;

  std::string name, unit;
  double value = 0;
  double step = 0;      // a small change, > 0
  double max_step = 0;  // the largest such change, +∞ except for delays
  double other = 0;     // the prior that it would get is between the value and this one
  int delayed_channel = kNoChannel;  // the measured output whose delay it is
};

// Returns gain, delay and offset of the measured outputs and of the driven inputs, then the model's
// parameters and initial states, unless they are uncertain, derived or without a value. Delays are
// changed by a small part of the interval between samples.
std::vector<FixedQuantity> FixedQuantitiesOf(const ResolvedProblem& problem, double interval_s);

// Returns the problem with these quantities uncertain, after its own parameters; nothing if it does
// not allow the values between value and other.
std::optional<ResolvedProblem> WithUncertain(const ResolvedProblem& problem,
                                             const std::vector<FixedQuantity>& quantities);

}  // namespace polyest::internal
