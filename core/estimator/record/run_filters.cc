#include "core/estimator/record/run_filters.h"

#include <cmath>
#include <utility>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Returns the outputs asked for and, behind them, the measured ones.
std::vector<int> AskedAndMeasured(const ResolvedProblem& problem, std::vector<int> outputs) {
  outputs.insert(outputs.end(), problem.outputs().begin(), problem.outputs().end());
  return outputs;
}

}  // namespace

RunFilters::RunFilters(const ResolvedProblem& problem, const Matrix& thetas,
                       const std::vector<int>& outputs, const InputSignals* inputs,
                       double horizon_s, int threads)
    : asked_(std::ssize(outputs)),
      channels_(problem.channels()),
      horizon_s_(horizon_s),
      behind_(problem.MakeEnsemble(thetas, problem.outputs(), threads), inputs),
      ahead_(problem.MakeEnsemble(thetas, AskedAndMeasured(problem, outputs), threads), inputs) {}

absl::Status RunFilters::Predict(double time_s, MatrixRef means, MatrixRef deviations,
                                 const Stop& stop) {
  const bool ends = horizon_s_ == 0 || time_s > window_start_s_ + horizon_s_;
  if (ends && !times_s_.empty()) POLYEST_RETURN_IF_ERROR(EndWindow(stop));
  Matrix all_means(means.rows(), asked_ + channels_),
      all_deviations(means.rows(), asked_ + channels_);
  POLYEST_RETURN_IF_ERROR(ahead_.Predict(time_s, all_means, all_deviations, stop));
  means = all_means.leftCols(asked_);
  deviations = all_deviations.leftCols(asked_);
  return absl::OkStatus();
}

void RunFilters::Take(double time_s, std::span<const double> samples,
                      std::span<const double> noise) {
  times_s_.push_back(time_s);
  for (size_t c = 0; c < static_cast<size_t>(channels_); ++c) {
    const bool missing = samples.empty() || std::isnan(samples[c]);
    values_.push_back(missing ? 0 : samples[c]);
    noise_.push_back(missing ? 0 : noise[c]);
  }
}

absl::Status RunFilters::EndWindow(const Stop& stop) {
  const Eigen::Index count = std::ssize(times_s_);
  Matrix innovations(behind_.members(), channels_ * count), log_variances = innovations;
  const FilterSamples samples{times_s_, Eigen::Map<const Matrix>(values_.data(), channels_, count),
                              Eigen::Map<const Matrix>(noise_.data(), channels_, count)};
  POLYEST_RETURN_IF_ERROR(behind_.Advance(samples, innovations, log_variances, stop));
  ahead_.TakeStatesOf(behind_);
  window_start_s_ = times_s_.back();
  times_s_.clear();
  values_.clear();
  noise_.clear();
  return absl::OkStatus();
}

}  // namespace polyest::internal
