#include "core/bayes/pareto_tail.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {
namespace {

constexpr Eigen::Index kMinExcesses = 5;
// Weight, in excesses, of the prior knowledge that k is about ½.
constexpr double kPriorExcesses = 10;
constexpr double kPriorShape = 0.5;

}  // namespace

std::optional<double> ParetoShape(Vector excesses) {
  std::sort(excesses.begin(), excesses.end());
  const Eigen::Index count = excesses.size();
  if (count < kMinExcesses) return std::nullopt;
  const auto n = static_cast<double>(count);
  const double quarter = excesses[static_cast<Eigen::Index>(n / 4 + 0.5) - 1];
  const double largest = excesses[count - 1];
  if (!(quarter > 0) || !std::isfinite(largest) || quarter == largest) return std::nullopt;
  // The posterior mean of b = −k/σ over a grid of the profile likelihood, L(b) = N (log(−b/k) − k −
  // 1) with k = mean log(1 − b x).
  const auto shape = [&](double b) { return (-b * excesses.array()).log1p().mean(); };
  const int grid = 30 + static_cast<int>(std::sqrt(n));
  Vector values(grid), likelihoods(grid);
  for (int j = 0; j < grid; ++j) {
    const double b = 1 / largest + (1 - std::sqrt(grid / (j + 0.5))) / (3 * quarter);
    const double k = shape(b);
    values[j] = b;
    likelihoods[j] = n * (std::log(-b / k) - k - 1);
  }
  const Vector weights = (likelihoods.array() - likelihoods.maxCoeff()).exp();
  const double k = shape(weights.dot(values) / weights.sum());
  if (!std::isfinite(k)) return std::nullopt;
  return (n * k + kPriorExcesses * kPriorShape) / (n + kPriorExcesses);
}

std::optional<double> TailShape(Vector log_weights) {
  const Eigen::Index count = log_weights.size();
  const auto n = static_cast<double>(count);
  const auto tail = static_cast<Eigen::Index>(std::min(0.2 * n, std::ceil(3 * std::sqrt(n))));
  if (tail < kMinExcesses) return std::nullopt;
  std::sort(log_weights.begin(), log_weights.end());
  const double largest = log_weights[count - 1];
  if (!std::isfinite(largest)) return std::nullopt;
  const double threshold = std::exp(log_weights[count - tail - 1] - largest);
  return ParetoShape((log_weights.tail(tail).array() - largest).exp() - threshold);
}

}  // namespace polyest::internal
