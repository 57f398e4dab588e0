#pragma once

// The statistics of the record that an estimate reports, in constant memory.

#include <cstdint>
#include <vector>

#include "core/estimator/record/data_facts.h"
#include "core/estimator/record/learned_noise.h"
#include "polyest/samples.h"

namespace polyest::internal {

class RecordSummary {
 public:
  struct Channel {
    int64_t samples = 0;
    double noise_variance_sum = 0;  // sum of the variances that the problem gives
    double largest = 0;             // largest |z|
    int64_t intervals = 0;          // between successive samples of a run
    double interval_sum_s = 0;
    double least_interval_s = 0;  // 0 without intervals
    double longest_run_s = 0;     // from the first to the last sample of a run
    double run_began_s = 0;
    double last_time_s = 0;
    int last_run = -1;

    // Returns the number of runs that have samples.
    int64_t Runs() const { return samples - intervals; }
    double RootMeanSquareNoise() const;  // of the noise that the problem gives
    double MeanInterval() const;         // in s; 0 without intervals
    // Returns exp(−Δt/τ), the correlation of successive samples with this noise, at the mean
    // interval.
    double Correlation(const ChannelNoise& noise) const;
    // Adds the time of a sample: the interval since the sample before, if that is of the same run.
    void AddTime(const SampleRow& row);
  };

  // Adds row `row` of the block, whose samples are those of `channels` channels.
  void Add(const RowBlock& block, int row, int channels);
  // Adds what the prior predicts for the channel's next sample; rows must have been added.
  void AddPrediction(int channel, const PriorPrediction& prediction) {
    facts_.AddPrediction(channel, prediction);
  }

  int64_t rows() const { return rows_; }
  int64_t samples() const;                   // over all channels
  double time_s() const { return time_s_; }  // of the last row
  // Returns the least ratio over the channels of root mean square noise to largest sample, at most
  // 1. For correlated noise the ratio is that of its innovations. Returns 1 before any sample.
  double NoiseToSignal(const LearnedNoise& noise) const;
  const std::vector<Channel>& channels() const { return channels_; }
  // Returns the first rows of the first run, at most kBeginning, which suffice to see how the
  // record is sampled.
  const RowBlock& beginning() const { return beginning_; }
  // Returns what suspicious data are recognized by.
  const DataFacts& facts() const { return facts_; }

  static constexpr int kBeginning = 64;

  // cereal calls this for writing and for reading.
  template <class Archive>
  void serialize(Archive& archive) {
    archive(rows_, time_s_, channels_, beginning_, facts_);
  }

 private:
  int64_t rows_ = 0;
  double time_s_ = 0;
  std::vector<Channel> channels_;
  RowBlock beginning_;
  DataFacts facts_;
};

}  // namespace polyest::internal
