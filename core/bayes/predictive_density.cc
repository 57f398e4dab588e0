#include "core/bayes/predictive_density.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/bayes/log_sum_exp.h"
#include "core/chaos/beta_gamma.h"
#include "core/chaos/germ.h"
#include "core/chaos/normal.h"

namespace polyest::internal {
namespace {

constexpr double kAccuracy = 1e-6;  // of quantiles, in standard deviations
constexpr int kMaxIterations = 200;
constexpr double kStudentTVariance = 2;  // ν/(ν − 2) with ν = 4
constexpr double kGoldenSection = 0.618;

double Kernel(NoiseKernel kernel, double u) {
  if (kernel == NoiseKernel::kNormal) {
    return std::exp(-0.5 * u * u) / std::sqrt(2 * std::numbers::pi);
  }
  return 0.375 * std::pow(1 + 0.25 * u * u, -2.5);
}

double LogKernel(NoiseKernel kernel, double u) {
  if (kernel == NoiseKernel::kNormal) {
    return -0.5 * u * u - 0.5 * kLogTwoPi;
  }
  return std::log(0.375) - 2.5 * std::log1p(0.25 * u * u);
}

double CumulativeKernel(NoiseKernel kernel, double u) {
  if (kernel == NoiseKernel::kNormal) return NormalCdf(u);
  const double w = u / std::sqrt(4 + u * u);
  return 0.5 + 0.75 * (w - w * w * w / 3);
}

}  // namespace

double PredictiveDensity::Mean() const { return y_.mean(); }

double PredictiveDensity::StandardDeviation() const {
  const double variance = (y_.array() - y_.mean()).square().mean();
  const double noise = s_.squaredNorm() / static_cast<double>(s_.size());
  return std::sqrt(variance + (kernel_ == NoiseKernel::kNormal ? 1 : kStudentTVariance) * noise);
}

double PredictiveDensity::LogDensity(double z) const {
  const auto term = [&](Eigen::Index d) {
    return LogKernel(kernel_, (z - y_[d]) / s_[d]) - std::log(s_[d]);
  };
  return LogSumExp(y_.size(), term, static_cast<double>(y_.size()));
}

double PredictiveDensity::Density(double z) const {
  double sum = 0;
  for (Eigen::Index d = 0; d < y_.size(); ++d) sum += Kernel(kernel_, (z - y_[d]) / s_[d]) / s_[d];
  return sum / static_cast<double>(y_.size());
}

double PredictiveDensity::Cumulative(double z) const {
  double sum = 0;
  for (Eigen::Index d = 0; d < y_.size(); ++d) {
    sum += CumulativeKernel(kernel_, (z - y_[d]) / s_[d]);
  }
  return sum / static_cast<double>(y_.size());
}

// Newton's iteration within a bracket, halved where it leaves it.
double PredictiveDensity::Quantile(double p) const {
  const double spread = StandardDeviation();
  double z = Mean() + spread * Germ::Normal().Quantile(p);
  double lower = z - spread, upper = z + spread;
  for (double step = spread; Cumulative(lower) > p; step *= 2) lower -= step;
  for (double step = spread; Cumulative(upper) < p; step *= 2) upper += step;
  for (int i = 0; i < kMaxIterations && upper - lower > kAccuracy * spread; ++i) {
    if (!(z > lower && z < upper)) z = 0.5 * (lower + upper);
    const double excess = Cumulative(z) - p;
    (excess > 0 ? upper : lower) = z;
    const double next = z - excess / Density(z);
    if (std::abs(next - z) < kAccuracy * spread) return std::clamp(next, lower, upper);
    z = next;
  }
  return z;
}

std::vector<Eigen::Index> ScatteredOrder(int count) {
  // Multiples of the golden section modulo `count`, with a step that has no divisor in common.
  int step = std::max(1, static_cast<int>(kGoldenSection * count));
  while (std::gcd(step, count) > 1) ++step;
  std::vector<Eigen::Index> order;
  for (int64_t i = 0; i < count; ++i) order.push_back(i * step % count);
  return order;
}

Vector ScaleFactors(double degrees_of_freedom, int count) {
  const double shape = std::max(2.0, degrees_of_freedom) / 2;  // χ²_ν/2 ~ Gamma(ν/2)
  Vector factors(count);
  for (int d = 0; d < count; ++d) {
    const double p = (d + 0.5) / count;
    const double x = p <= 0.5 ? LowerGammaQuantile(shape, p) : UpperGammaQuantile(shape, 1 - p);
    factors[d] = std::sqrt(shape / x);
  }
  return factors(ScatteredOrder(count));
}

}  // namespace polyest::internal
