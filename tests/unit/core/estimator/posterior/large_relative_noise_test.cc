// Compares estimates from samples whose noise is a large part of the prediction with the exact
// posterior, by quadrature.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::large_relative_noise_test {
namespace {

constexpr double kLower = 0.2, kUpper = 5;
// What is tolerated of draws: their own error is about 1/√4000 standard deviations.
constexpr double kOfMean = 0.1, kOfDeviation = 0.1;

struct Moments {
  double mean = 0, deviation = 0;
};

// Returns those of a density by its −log at the midpoints of a grid.
Moments MomentsOf(const std::function<double(double)>& cost) {
  constexpr int kPoints = 20'000;
  const double step = (kUpper - kLower) / kPoints;
  std::vector<double> costs;
  for (int i = 0; i < kPoints; ++i) costs.push_back(cost(kLower + (i + 0.5) * step));
  const double least = std::ranges::min(costs);
  double sum = 0, first = 0, second = 0;
  for (int i = 0; i < kPoints; ++i) {
    const double a = kLower + (i + 0.5) * step,
                 weight = std::exp(least - costs[static_cast<size_t>(i)]);
    sum += weight;
    first += weight * a;
    second += weight * a * a;
  }
  return {first / sum, std::sqrt(second / sum - first * first / (sum * sum))};
}

// The output at the sample i: a constant, or a line that begins near 2.
enum class Output { kConstant, kLine };

double Predicted(Output output, double a, size_t i) {
  return output == Output::kConstant ? a : 2 + a * static_cast<double>(i + 1) / 10;
}

// −log of the likelihood of samples with the noise r y, whose size is integrated out with the
// density 1/s if it is unknown.
double CostOf(Output output, const std::vector<double>& z, double r, bool unknown, double a) {
  double chi_squared = 0, logs = 0;
  for (size_t i = 0; i < z.size(); ++i) {
    const double y = Predicted(output, a, i);
    chi_squared += std::pow((z[i] - y) / (r * y), 2);
    logs += std::log(y);
  }
  const auto n = static_cast<double>(z.size());
  return logs + (unknown ? 0.5 * n * std::log(chi_squared) : 0.5 * chi_squared);
}

std::vector<double> Noisy(Output output, double r, size_t count, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> z;
  for (size_t i = 0; i < count; ++i)
    z.push_back(Predicted(output, 1.5, i) * (1 + r * normal(random)));
  return z;
}

Problem MakeProblem(Output output, double r, bool unknown) {
  Problem problem = TextProblem(output == Output::kConstant ? "a" : "2 + a*t/10",
                                {UncertainParameter::Uniform("a", kLower, kUpper).value()}, 1);
  problem.measured[0].noise = {.relative = r, .unknown = unknown};
  return problem;
}

void ExpectExact(Output output, double r, bool unknown, const std::vector<double>& z) {
  const Estimate estimate =
      Processed(MakeProblem(output, r, unknown), z)->CurrentEstimate().value();
  const Moments exact = MomentsOf([&](double a) { return CostOf(output, z, r, unknown, a); });
  const ParameterEstimate& a = estimate.parameters[0];
  EXPECT_NEAR(a.mean, exact.mean, kOfMean * exact.deviation);
  EXPECT_NEAR(a.posterior_std_dev, exact.deviation, kOfDeviation * exact.deviation);
  for (const Diagnostic& one : estimate.diagnostics) {
    EXPECT_EQ(one.code, DiagnosticCode::kNonGaussian) << one.message;
  }
}

// Some samples are near 0, where a noise relative to the samples is far too small.
TEST(LargeRelativeNoise, LeavesThePosteriorOfAConstantExact) {
  for (const double r : {0.3, 0.5}) {
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(::testing::Message() << r << " seed " << seed);
      ExpectExact(Output::kConstant, r, false, Noisy(Output::kConstant, r, 25, seed));
    }
  }
}

// If only its size is unknown, the noise tells where the predictions are larger than elsewhere.
TEST(LargeRelativeNoise, TellsOfPredictionsThoughItsSizeIsUnknown) {
  for (const double r : {0.3, 0.5}) {
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(::testing::Message() << r << " seed " << seed);
      ExpectExact(Output::kLine, r, true, Noisy(Output::kLine, r, 25, seed));
    }
  }
}

// The first samples count as the others do: there is no row from which on the noise is another one.
TEST(LargeRelativeNoise, LeavesThePosteriorOfAFewSamplesExact) {
  for (const size_t count : {1, 2, 4, 7}) {
    SCOPED_TRACE(count);
    ExpectExact(Output::kConstant, 0.4, false, Noisy(Output::kConstant, 0.4, count, 5));
  }
}

}  // namespace
}  // namespace polyest::internal::large_relative_noise_test
