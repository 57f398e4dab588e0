#include "core/bayes/convergence.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/chaos/germ.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

double Variance(const Vector& values) {
  const double mean = values.mean();
  return (values.array() - mean).square().sum() / static_cast<double>(values.size() - 1);
}

// Returns the sum of ρ_t + ρ_{t+1} over t = 0, 2, 4 … while they are positive, each limited to the
// one before.
double SumOfInitialMonotoneSequence(const Vector& correlation) {
  double sum = 0;
  double last = std::numeric_limits<double>::infinity();
  for (Eigen::Index t = 0; t + 1 < correlation.size(); t += 2) {
    const double pair = correlation[t] + correlation[t + 1];
    if (!(pair > 0)) break;
    last = std::min(last, pair);
    sum += last;
  }
  return sum;
}

}  // namespace

Matrix RankNormalized(const ConstMatrixRef& draws) {
  const Eigen::Index count = draws.size();
  Matrix scores = draws;
  double* const value = scores.data();
  std::vector<Eigen::Index> order(static_cast<size_t>(count));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::sort(order.begin(), order.end(),
            [&](Eigen::Index a, Eigen::Index b) { return value[a] < value[b]; });
  const Germ normal = Germ::Normal();
  for (size_t first = 0; first < order.size();) {
    size_t end = first + 1;
    while (end < order.size() && value[order[end]] == value[order[first]]) ++end;
    // The equal draws have the ranks first + 1 … end and share their mean.
    const double rank = 0.5 * static_cast<double>(first + 1 + end);
    const double score = normal.Quantile((rank - 0.375) / (static_cast<double>(count) + 0.25));
    for (; first < end; ++first) value[order[first]] = score;
  }
  return scores;
}

double SplitRHat(const ConstMatrixRef& normalized, int groups) {
  const Eigen::Index half = normalized.rows() / 2;
  const Eigen::Index columns = normalized.cols() / groups;
  POLYEST_CHECK(groups >= 2 && half >= 1 && columns * groups == normalized.cols());
  Vector means(2 * groups), variances(2 * groups);
  for (int s = 0; s < 2 * groups; ++s) {
    const Eigen::Index first = s % 2 == 0 ? 0 : normalized.rows() - half;
    const Vector sequence = normalized.block(first, s / 2 * columns, half, columns).reshaped();
    means[s] = sequence.mean();
    variances[s] = sequence.size() > 1 ? Variance(sequence) : 0;
  }
  const double within = variances.mean();
  if (!(within > 0)) return 1;
  const auto count = static_cast<double>(half * columns);
  // R̂ = √((N − 1)/N + (B/N)/W)
  return std::sqrt((count - 1) / count + Variance(means) / within);
}

double EffectiveSize(const ConstMatrixRef& normalized) {
  const Eigen::Index times = normalized.rows();
  const Eigen::Index chains = normalized.cols();
  POLYEST_CHECK(times >= 4 && chains >= 2);
  const auto t = static_cast<double>(times);
  const auto all = static_cast<double>(normalized.size());
  const Vector means = normalized.colwise().mean().transpose();
  const Matrix centred = normalized.rowwise() - means.transpose();
  const double within = centred.squaredNorm() / static_cast<double>(chains) / (t - 1);  // W
  const double total = (t - 1) / t * within + Variance(means);                          // var⁺
  if (!(total > 0)) return all;
  Vector correlation(times - 1);
  for (Eigen::Index lag = 0; lag < correlation.size(); ++lag) {
    // The mean over the chains of (1/T) Σ_t x_t x_{t+lag}.
    const double covariance =
        centred.topRows(times - lag).cwiseProduct(centred.bottomRows(times - lag)).sum() /
        (t * static_cast<double>(chains));
    correlation[lag] = lag == 0 ? 1 : 1 - (within - covariance) / total;
  }
  // τ = 1 + 2 Σ_{t≥1} ρ_t = −1 + 2 Σ_{t≥0} ρ_t
  const double time = -1 + 2 * SumOfInitialMonotoneSequence(correlation);
  return std::min(all, all / std::max(time, 1.0));
}

}  // namespace polyest::internal
