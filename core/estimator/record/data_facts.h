#pragma once

// Facts of a record by which suspicious data are recognized: its intervals, each column's range,
// and how far the first samples are from what the prior predicts. Memory is constant.

#include <cstdint>
#include <vector>

#include "core/estimator/record/octave_sums.h"
#include "core/estimator/record/signal_faults.h"
#include "polyest/samples.h"

namespace polyest::internal {

// The intervals between successive rows of a run, in s.
class IntervalFacts {
 public:
  // An interval of so many usual ones is a gap.
  static constexpr double kGapSteps = 10;

  void Add(const SampleRow& row);

  // Returns the usual interval (OctaveSums::Usual); 0 if no run has two rows.
  double usual_s() const { return intervals_s_.Usual(); }
  // Returns how many intervals lie in octaves whose mean is at least a gap, and at least 1 if the
  // longest interval is a gap.
  int64_t gaps() const;
  double longest_s() const { return longest_s_; }
  double longest_after_s() const { return longest_after_s_; }  // time at which the longest begins
  double latest_first_s() const { return latest_first_s_; }    // latest time of a run's first row
  // Returns whether a run's first row is so many usual intervals after t = 0 that they can hardly
  // be meant.
  bool StartsLate() const { return usual_s() > 0 && latest_first_s_ > kGapSteps * usual_s(); }

  bool IsConsistent() const;  // false after reading what was never written

  template <class Archive>
  void serialize(Archive& archive) {
    archive(rows_, run_, time_s_, longest_s_, longest_after_s_, latest_first_s_, intervals_s_);
  }

 private:
  int64_t rows_ = 0;
  int run_ = 0;
  double time_s_ = 0;
  double longest_s_ = 0, longest_after_s_ = 0, latest_first_s_ = 0;
  OctaveSums intervals_s_;
};

// What the prior predicts for one sample.
struct PriorPrediction {
  double value = 0;     // the sample
  double mean = 0;      // of the output over the prior
  double variance = 0;  // of the output over the prior, with the expansion's own error
  double noise = 0;     // standard deviation of the sample's noise
};

// The values of one column: a measured output or a streamed input.
struct ColumnFacts {
  // So many different values show the step of a converter or of a file with few digits.
  static constexpr size_t kMaxDistinct = 32;

  int64_t samples = 0;
  double smallest = 0, largest = 0;
  double mean = 0, square_sum = 0;          // Σ (z − mean)²
  double min_noise = 0, max_noise = 0;      // of measured samples
  std::vector<double> distinct;             // the first different values, in increasing order
  SignalFaults faults;                      // of a measured output
  int64_t predicted = 0, far = 0;           // samples with a prediction, and those far from it
  PriorPrediction first;                    // of the first sample
  double error_sum = 0, deviation_sum = 0;  // Σ (z − mean)², Σ (variance + noise²)

  // `noise` is 0 for an input.
  void Add(double value, double noise);
  void AddPrediction(const PriorPrediction& prediction);
  bool IsConsistent() const;  // false after reading what was never written
  double Spread() const;      // the standard deviation of the values
  // Returns the step of which all differences between the distinct values are multiples, such as
  // that of an analogue-to-digital converter; 0 if there is none or there are fewer than `least`.
  double Resolution(size_t least = 4) const;

  template <class Archive>
  void serialize(Archive& archive) {
    archive(samples, smallest, largest, mean, square_sum, min_noise, max_noise, distinct);
    archive(faults, predicted, far, first.value, first.mean, first.variance, first.noise, error_sum,
            deviation_sum);
  }
};

// The times of a streamed input's samples, and how much it bends between them.
struct InputFacts {
  IntervalFacts intervals;                   // between its samples
  int64_t runs_without = 0;                  // runs that have ended without any sample of it
  double longest_end_s = 0, end_from_s = 0;  // longest time from its last sample in a run to the
                                             // run's last row, and the time of that sample
  double last_s = 0;                         // time of the last sample, if the run has any
  int64_t samples_in_run = 0;
  double value = 0, step = 0;  // the last one in the run, and its change from the one before
  double bends = 0;  // Σ of squares of second differences u_k − 2 u_(k−1) + u_(k−2)

  void Add(const SampleRow& row, double next);
  void EndRun(double last_row_s);
  bool IsConsistent() const;  // false after reading what was never written

  template <class Archive>
  void serialize(Archive& archive) {
    archive(intervals, runs_without, longest_end_s, end_from_s, last_s, samples_in_run, value, step,
            bends);
  }
};

// Returns how far a sample is from its prediction: in standard deviations of what the prior and the
// noise leave open, after a relative error of the integrator's is taken out.
double DistanceOf(const PriorPrediction& prediction);

class DataFacts {
 public:
  // A sample so many standard deviations away from the prior's prediction is far from it.
  static constexpr double kFar = 10;

  // Adds row `row` of the block, whose first columns are those of `channels` measured outputs.
  void Add(const RowBlock& block, int row, int channels);
  // Adds what the prior predicts for the channel's next sample; rows must have been added.
  void AddPrediction(int channel, const PriorPrediction& prediction) {
    columns_[static_cast<size_t>(channel)].AddPrediction(prediction);
  }

  const IntervalFacts& intervals() const { return intervals_; }
  const std::vector<ColumnFacts>& columns() const { return columns_; }  // empty before any row

  // By streamed input; empty before any row.
  const std::vector<InputFacts>& inputs() const { return inputs_; }

  // Whether these may be the facts of a record of so many columns, the last `inputs` of which are
  // streamed inputs; false for corrupted ones.
  bool IsFor(size_t columns, size_t inputs) const;

  template <class Archive>
  void serialize(Archive& archive) {
    archive(intervals_, columns_, inputs_, run_, time_s_, ended_run_);
  }

 private:
  void EndRun();

  IntervalFacts intervals_;
  std::vector<ColumnFacts> columns_;
  std::vector<InputFacts> inputs_;
  int run_ = -1;  // of the last row
  double time_s_ = 0;
  int ended_run_ = -1;  // the last run whose end has been counted
};

}  // namespace polyest::internal
