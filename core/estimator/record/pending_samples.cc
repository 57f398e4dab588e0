#include "core/estimator/record/pending_samples.h"

#include <cmath>

#include "core/common/status.h"

namespace polyest::internal {

std::vector<int> AskedAndMeasured(const ResolvedProblem& problem, std::vector<int> outputs) {
  outputs.insert(outputs.end(), problem.outputs().begin(), problem.outputs().end());
  return outputs;
}

void PendingSamples::Add(double time_s, std::span<const double> samples,
                         std::span<const double> noise) {
  times_s_.push_back(time_s);
  values_.resize(values_.size() + static_cast<size_t>(before_), 0);
  noise_.resize(noise_.size() + static_cast<size_t>(before_), 0);
  for (size_t c = 0; c < static_cast<size_t>(channels_); ++c) {
    const bool missing = samples.empty() || std::isnan(samples[c]);
    values_.push_back(missing ? 0 : samples[c]);
    noise_.push_back(missing ? 0 : noise[c]);
  }
}

absl::Status PendingSamples::Give(FilterBank& filters, const Stop& stop) {
  const Eigen::Index outputs = before_ + channels_, count = std::ssize(times_s_);
  Matrix innovations(filters.members(), outputs * count), log_variances = innovations;
  const FilterSamples samples{times_s_, Eigen::Map<const Matrix>(values_.data(), outputs, count),
                              Eigen::Map<const Matrix>(noise_.data(), outputs, count)};
  POLYEST_RETURN_IF_ERROR(filters.Advance(samples, innovations, log_variances, stop));
  times_s_.clear();
  values_.clear();
  noise_.clear();
  return absl::OkStatus();
}

}  // namespace polyest::internal
