#pragma once

// An input as a server finds it: straight lines between points.

#include <absl/status/statusor.h>

#include <vector>

#include "core/model/input_signal.h"

namespace polyest::internal {

struct InputLines {
  std::vector<double> times_s;  // non-decreasing; twice the same where the input jumps
  std::vector<double> values;   // one for each time
};

// Returns the lines that stand for shape(t − delay) from t = 0 to `end_s` ≥ 0. They pass through
// every knot and every jump. A curve is cut into lines: ten between two knots, 200 in a period of a
// sine and 100 in half a sine, which deviate from a sine by at most 1.3e-4 of its amplitude. Lines
// up to an earlier time are the first ones of those up to a later time, except for the last one.
// Returns FailedPrecondition if there would be more than a million.
absl::StatusOr<InputLines> LinesOf(const InputSignal& signal, double delay_s, double end_s);

}  // namespace polyest::internal
