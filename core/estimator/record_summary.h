#pragma once

// What an estimate reports of the record itself, in constant memory.

#include <cstdint>
#include <vector>

#include "core/estimator/regional_expansion.h"

namespace polyest {

class RecordSummary {
 public:
  struct Channel {
    int64_t samples = 0;
    double noise_variance_sum = 0;
    double largest = 0;  // |z|

    double RootMeanSquareNoise() const;
  };

  void Add(const RowBlock& block, int row, int channels);

  int64_t rows() const { return rows_; }
  int64_t samples() const;  // over all channels
  double time_s() const { return time_s_; }
  // The least over the channels of root mean square noise ÷ largest sample; 1 before any sample.
  double NoiseToSignal() const;
  const std::vector<Channel>& channels() const { return channels_; }
  // The first rows of the first run, at most kBeginning: enough to see how the record is sampled.
  const RowBlock& beginning() const { return beginning_; }

  static constexpr int kBeginning = 64;

 private:
  int64_t rows_ = 0;
  double time_s_ = 0;
  std::vector<Channel> channels_;
  RowBlock beginning_;
};

}  // namespace polyest
