#pragma once

// How residuals scatter: their χ², and what their correlation does to sums of them.

#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

// Sums over the residuals of several channels, in units of their noise and in the order of time.
class ResidualScatter {
 public:
  explicit ResidualScatter(Eigen::Index channels) : channels_(static_cast<size_t>(channels)) {}

  // Adds residuals (channels by turns); 0 stands for a missing one. They do not go on from those
  // before if a run begins with them.
  void Add(const Vector& residuals, bool begins_run);

  double ChiSquared() const;
  // Returns χ²/N of a channel; 1 if it has no samples.
  double MeanSquare(Eigen::Index channel) const;
  // Returns the variance of sums of residuals relative to that of right ones, at least 1. It is
  // that of the channel where it is largest: χ²/N times (1 + r)/(1 − r), r the correlation of
  // successive residuals, or times the variance of sums of 16 of them relative to that of
  // independent ones, if that is larger.
  double Dispersion() const;

 private:
  static constexpr int kOfBlock = 16;

  struct Channel {
    double samples = 0, squares = 0, products = 0, last = 0;
    double sum = 0, squares_of_sums = 0, sums = 0;  // of blocks
    int in_sum = 0;
  };

  std::vector<Channel> channels_;
};

}  // namespace polyest::internal
