#pragma once

// The signal that an InputSpecification describes (polyest/input_signal.h): u(t) = amplitude ·
// shape(t).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <optional>
#include <span>
#include <vector>

#include "polyest/input_signal.h"

namespace polyest::internal {

class InputSignal {
 public:
  // INVALID_ARGUMENT names the field as in a problem file, the value and the rule:
  // "sinusoid: frequencyHz 0 must be finite and above 0".
  static absl::StatusOr<InputSignal> Make(InputSpecification specification);

  double default_amplitude() const;
  bool streamed() const;
  // What it was made of, but for a table's knots: those are below, with a streamed signal's.
  const InputSpecification& specification() const { return specification_; }
  std::span<const double> knot_times_s() const { return knot_time_s_; }
  std::span<const double> knot_values() const { return knot_value_; }
  // A streamed signal's next knot: finite, times strictly increasing within a run; amortized O(1).
  void Append(double time_s, double value);
  // No more knots of a streamed signal will come.
  void Finish();
  bool finished() const { return finished_; }
  // Forgets the knots of a streamed signal: a new run begins.
  void Clear();

  // Knots that must follow a knot before the signal up to it is settled, unless it is finished.
  int knots_ahead() const;

  // shape(t), for a streamed signal no later than it is settled. It is its first value before its
  // first knot and its last value after its last, and 0 while it has none. At a jump (step, held
  // knot, end of a chirp) it is the value from the right; the one from the left is
  // Shape(std::nextafter(break, −∞)).
  double Shape(double time_s) const;
  // The first time strictly after time_s at which shape or its derivative jumps; +∞ if none. A
  // smooth curve has none but its ends.
  double NextBreak(double time_s) const;
  // Whether shape itself jumps at its breaks (step, chirp, hold), so that an
  // integrator must also forget the derivative it kept from before.
  bool Jumps() const;

 private:
  explicit InputSignal(InputSpecification specification);
  std::optional<Interpolation> interpolation() const;  // of a signal with knots
  void SettleSlopes();
  double EndAfter(double time_s) const;
  double BetweenKnots(double time_s, Interpolation interpolation) const;

  InputSpecification specification_;  // a table's knots are moved out of it
  std::vector<double> knot_time_s_;
  std::vector<double> knot_value_;
  std::vector<double> knot_slope_;  // of a smooth curve, as far as it is settled
  bool finished_ = false;
};

}  // namespace polyest::internal
