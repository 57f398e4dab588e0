#pragma once

// The signal of an InputSpecification (polyest/input_signal.h): u(t) = amplitude · shape(t).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <optional>
#include <span>
#include <vector>

#include "polyest/input_signal.h"

namespace polyest::internal {

class InputSignal {
 public:
  // Makes the signal. Returns InvalidArgument that names the field, the value and the rule:
  // "sinusoid: frequency_hz 0 must be finite and above 0".
  static absl::StatusOr<InputSignal> Make(InputSpecification specification);

  // Returns the amplitude of the specification.
  double default_amplitude() const;
  // Whether the knots arrive with the measurements (StreamedInput).
  bool streamed() const;
  // Returns the specification that the signal was made from, without a table's knots: those are in
  // knot_times_s() and knot_values(), as are the knots of a streamed signal.
  const InputSpecification& specification() const { return specification_; }
  std::span<const double> knot_times_s() const { return knot_time_s_; }
  std::span<const double> knot_values() const { return knot_value_; }
  // Returns the slopes at the knots of a smooth curve, as far as it is settled.
  std::span<const double> knot_slopes() const { return knot_slope_; }
  // Adds the next knot of a streamed signal, in amortized O(1). Time and value must be finite, and
  // times must strictly increase within a run.
  void Append(double time_s, double value);
  // Declares that no more knots of a streamed signal will follow.
  void Finish();
  bool finished() const { return finished_; }
  // Releases the memory of knots that Shape and the slopes yet to come do not need at or after
  // `time_s`, in amortized O(1). The signal must not be evaluated before that time any more.
  void Forget(double time_s);
  // Removes the knots of a streamed signal, for a new run.
  void Clear();

  // Returns how many later knots must be known before the signal is settled up to a knot. A
  // finished signal is settled everywhere.
  int knots_ahead() const;
  // Returns how many knots at or after a time must be known before a streamed signal is settled up
  // to there; 0 for a held one, for which those before are enough, if there are any.
  int knots_needed() const;
  // Whether Shape is known up to time_s, whatever knots may follow. All knots up to there must have
  // been appended.
  bool SettledUpTo(double time_s) const;

  // Returns shape(t). A streamed signal must be settled up to time_s. Before the first knot the
  // shape is the first value, after the last knot the last value, and without knots 0. At a jump
  // (step, held knot, end of a chirp) it is the value from the right; the value from the left is
  // Shape(std::nextafter(break, −∞)).
  double Shape(double time_s) const;
  // As Shape(time_s), but finds the interval between knots without a search where the time is close
  // to the caller's last one. The caller keeps `knots`, the number of knots up to that time,
  // between its calls; it is 0 at first.
  double Shape(double time_s, size_t& knots) const;
  // Returns the first time strictly after time_s at which shape or its derivative jumps, or +∞ if
  // there is none. A smooth curve through knots has breaks only at its two ends.
  double NextBreak(double time_s) const;
  // Returns the first knot strictly after time_s, those of a smooth curve included; for a signal
  // without knots its next break; +∞ if there is none.
  double NextKnot(double time_s) const;
  // Whether shape itself jumps at its breaks (step, chirp, hold). An integrator must then also
  // discard the derivative that it has stored.
  bool Jumps() const;

 private:
  explicit InputSignal(InputSpecification specification);
  std::optional<Interpolation> interpolation() const;  // only for a signal with knots
  void SettleSlopes();
  double EndAfter(double time_s) const;
  size_t KnotsUpTo(double time_s, size_t guess) const;
  double BetweenKnots(double time_s, Interpolation interpolation, size_t right) const;

  InputSpecification specification_;  // without a table's knots, which are moved out of it
  std::vector<double> knot_time_s_;
  std::vector<double> knot_value_;
  std::vector<double> knot_slope_;  // for a smooth curve, as far as it is settled
  bool finished_ = false;
};

}  // namespace polyest::internal
