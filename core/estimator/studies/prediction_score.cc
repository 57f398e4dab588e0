#include "core/estimator/studies/prediction_score.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {
namespace {

constexpr double kTail = 0.025;  // outside of the central 95 %, on each side

}  // namespace

void ScoreSums::Add(const ScoredPrediction& sample) {
  ++samples_;
  if (sample.cumulative >= kTail && sample.cumulative <= 1 - kTail) ++covered_;
  log_density_ += sample.log_density;
  squares_ += sample.residual * sample.residual;
  standardized_squares_ += sample.standardized * sample.standardized;
  const auto size = std::ssize(recent_);
  if (size == 0) return;
  for (int64_t lag = 1; lag <= std::min<int64_t>(size, in_run_); ++lag) {
    const auto place = static_cast<size_t>((in_run_ - lag) % size);
    products_[lag - 1] += sample.standardized * recent_[place];
  }
  recent_[static_cast<size_t>(in_run_ % size)] = sample.standardized;
  ++in_run_;
}

PredictionScore ScoreSums::Score() const {
  PredictionScore score;
  score.samples = samples_;
  score.autocorrelation = Vector::Zero(products_.size());
  if (samples_ == 0) return score;
  const auto count = static_cast<double>(samples_);
  score.log_score = log_density_ / count;
  score.coverage95 = static_cast<double>(covered_) / count;
  score.root_mean_square = std::sqrt(squares_ / count);
  if (standardized_squares_ > 0) score.autocorrelation = products_ / standardized_squares_;
  return score;
}

}  // namespace polyest::internal
