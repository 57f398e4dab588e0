#pragma once

// Faults of a sensor that its samples show without any model: samples that drop out to one value,
// such as 0, and values that stop at the end of a measuring range. Memory is constant.

#include <algorithm>
#include <cstdint>
#include <limits>

#include "core/estimator/record/octave_sums.h"

namespace polyest::internal {

// A value and how often something happened at it.
struct RecurringValue {
  double value = 0;
  int64_t count = 0;

  template <class Archive>
  void serialize(Archive& archive) {
    archive(value, count);
  }
};

class SignalFaults {
 public:
  void Add(double value);
  // Samples of another run follow.
  void EndRun() { samples_ = 0; }

  // Returns the value at which most dropouts end and how many do; none if there is no such value.
  // A dropout is at most kLongestDropout samples of exactly one value, entered and left by jumps of
  // more than kJump usual steps.
  RecurringValue Dropouts() const;
  // Returns the largest (smallest) value of all and how many plateaus are at it; none unless at
  // least half of all plateaus are at either. A plateau is at least kShortestPlateau samples of
  // exactly one value, which the signal does not reach as smoothly as a rounded peak.
  RecurringValue UpperPlateaus() const { return OfExtremes(upper_); }
  RecurringValue LowerPlateaus() const { return OfExtremes(lower_); }

  // Returns the least size that the jumps of a dropout may have now; ∞ if no step has been seen.
  double SmallestJump() const { return kJump * UsualStep(); }
  // Returns the usual step (OctaveSums::Usual) or, where most samples are equal, the smallest.
  double UsualStep() const { return std::max(steps_.Usual(), smallest_step_); }
  // Returns the share of successive samples that differ; 1 if there are none.
  double ShareOfChanges() const;

  bool IsConsistent() const;  // false after reading what was never written

  template <class Archive>
  void serialize(Archive& archive) {
    archive(samples_, entry_, value_, length_, steps_, smallest_step_);
    archive(excursions_, votes_, candidate_, plateaus_, upper_, lower_);
  }

 private:
  static constexpr double kJump = 10;
  static constexpr int64_t kLongestDropout = 10;
  static constexpr int64_t kShortestPlateau = 3;

  void EndOfEqualSamples(double next);
  void AddExcursion();
  void AddExtreme(bool is_plateau);
  RecurringValue OfExtremes(const RecurringValue& extreme) const;

  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  int64_t samples_ = 0;               // of the run
  double entry_ = 0;                  // the step to the last value; 0 if it is the run's first
  double value_ = 0;                  // the last value,
  int64_t length_ = 0;                // which so many samples up to now have
  OctaveSums steps_;                  // between successive samples
  double smallest_step_ = kInfinity;  // of those that are not 0
  int64_t excursions_ = 0;            // dropouts to any value
  int64_t votes_ = 0;                 // those to the candidate's value, less those to others
  RecurringValue candidate_;          // how many there were since it became the candidate
  int64_t plateaus_ = 0;              // at any value
  RecurringValue upper_{-kInfinity}, lower_{kInfinity};
};

}  // namespace polyest::internal
