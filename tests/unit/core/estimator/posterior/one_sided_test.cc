// Tests what is said of a parameter of which the data tell a limit and no more: y = p⁴ + p/100 is
// nearly flat at the bound p = 0, where the cost has its minimum. The oracle is quadrature of the
// posterior's density.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

constexpr double kNoiseOfPower = 0.01, kValue = -0.005;

struct Exact {
  double mean = 0, std_dev = 0, below95 = 0;
};

// The prior is uniform over 0 … 1.
Exact OfQuadrature() {
  constexpr int kCells = 20'000;
  std::vector<std::pair<double, double>> cells;  // p and its weight
  double total = 0;
  for (int i = 0; i < kCells; ++i) {
    const double p = (i + 0.5) / kCells;
    const double e = (kValue - std::pow(p, 4) - p / 100) / kNoiseOfPower;
    cells.emplace_back(p, std::exp(-0.5 * e * e));
    total += cells.back().second;
  }
  Exact exact;
  double square = 0, below = 0;
  for (const auto& [p, weight] : cells) {
    exact.mean += p * weight / total;
    square += p * p * weight / total;
    if (below < 0.975) exact.below95 = p;
    below += weight / total;
  }
  exact.std_dev = std::sqrt(square - exact.mean * exact.mean);
  return exact;
}

TEST(OneSidedInformation, IsALimitAndNotThePrior) {
  Problem problem =
      TextProblem("p^4 + p/100", {UncertainParameter::Uniform("p", 0, 1).value()}, kNoiseOfPower);
  problem.expansion.order = 4;
  const Estimate estimate = Processed(problem, {kValue})->CurrentEstimate().value();
  const ParameterEstimate& p = estimate.parameters[0];
  const Exact exact = OfQuadrature();
  EXPECT_NEAR(p.mean, exact.mean, 0.03 * exact.std_dev);
  EXPECT_NEAR(p.std_dev, exact.std_dev, 0.03 * exact.std_dev);
  EXPECT_NEAR(p.upper95, exact.below95, 0.1 * exact.std_dev);
  EXPECT_NEAR(p.contraction, p.std_dev / p.prior_std_dev, 1e-12);
  EXPECT_NEAR(estimate.covariance(0, 0), p.std_dev * p.std_dev, 1e-12);
  EXPECT_EQ(p.verdict, Verdict::kWeak);
  EXPECT_THAT(Message(estimate, DiagnosticCode::kAtPriorBound),
              HasSubstr("tell only that it is below 0.3"));
}

// The sample lies below every value of y = p/10⁵, so that the cost is least at p = 0, by a
// millionth.
TEST(OneSidedInformation, IsNoneWhereThePosteriorIsAsWideAsThePrior) {
  const Problem problem =
      TextProblem("p/100000", {UncertainParameter::Uniform("p", 0, 1).value()}, kNoiseOfPower);
  const Estimate estimate = Processed(problem, {kValue})->CurrentEstimate().value();
  EXPECT_LT(estimate.parameters[0].map, 1e-6);  // which counts as on the bound
  EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kNotIdentified);
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kAtPriorBound));
}

}  // namespace
}  // namespace polyest::internal
