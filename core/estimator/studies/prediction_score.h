#pragma once

// Scores a prediction on the samples of one channel, one after another, in constant memory.

#include <vector>

#include "polyest/prediction.h"

namespace polyest::internal {

// What the prediction says of one sample.
struct ScoredPrediction {
  double residual = 0;      // sample − mean
  double standardized = 0;  // ÷ standard deviation of a new sample
  double log_density = 0;   // of the sample
  double cumulative = 0;    // probability of a smaller sample
};

class ScoreSums {
 public:
  explicit ScoreSums(int lags)
      : recent_(static_cast<size_t>(lags)), products_(Vector::Zero(lags)) {}

  // Adds the next sample of the present run.
  void Add(const ScoredPrediction& sample);
  // The next sample is of another run.
  void EndRun() { in_run_ = 0; }

  PredictionScore Score() const;

 private:
  int64_t samples_ = 0;
  int64_t covered_ = 0;
  double log_density_ = 0;
  double squares_ = 0;
  double standardized_squares_ = 0;
  std::vector<double> recent_;  // standardized residuals of the run, a ring of `lags`
  int64_t in_run_ = 0;
  Vector products_;  // by lag − 1: Σ u_k u_{k+lag}
};

}  // namespace polyest::internal
