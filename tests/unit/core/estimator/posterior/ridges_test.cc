// The data tell no more than a ratio or a sum of parameters: the posterior is a thin ridge along
// the other values they may have. The oracle is quadrature of the exact posterior along it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::ridges_test {
namespace {

// The draws are worth at least this many independent ones (posterior_draws.cc).
constexpr double kIndependent = 400;

struct Exact {
  double mean = 0, std_dev = 0, lower95 = 0, upper95 = 0;
};

// Returns what the density is between `lower` and `upper`, by the midpoint rule.
Exact ByQuadrature(const std::function<double(double)>& density, double lower, double upper) {
  constexpr int kCells = 20'000;
  const double width = (upper - lower) / kCells;
  std::vector<double> cumulative;
  double first = 0, second = 0, sum = 0;
  for (int i = 0; i < kCells; ++i) {
    const double x = lower + (i + 0.5) * width, weight = density(x);
    sum += weight;
    first += weight * x;
    second += weight * x * x;
    cumulative.push_back(sum);
  }
  const auto quantile = [&](double p) {
    const auto cell = std::ranges::lower_bound(cumulative, p * sum) - cumulative.begin();
    return lower + (static_cast<double>(cell) + 0.5) * width;
  };
  const double mean = first / sum;
  return {mean, std::sqrt(second / sum - mean * mean), quantile(0.025), quantile(0.975)};
}

void Expect(const ParameterEstimate& parameter, const Exact& exact) {
  const double error = 4 * exact.std_dev / std::sqrt(kIndependent);
  EXPECT_NEAR(parameter.mean, exact.mean, error);
  EXPECT_NEAR(parameter.posterior_std_dev, exact.std_dev, error / std::sqrt(2));
  // A quantile errs by √(p (1 − p)/N) ÷ the density there, which is about that of a normal.
  const double at_quantile = 4 * std::sqrt(0.025 * 0.975 / kIndependent) / 0.0584 * exact.std_dev;
  EXPECT_NEAR(parameter.lower95, exact.lower95, at_quantile);
  EXPECT_NEAR(parameter.upper95, exact.upper95, at_quantile);
}

// log m ~ N(location, scale²), whose density of m times that of k = r m, uniform, times dk/dr = m.
TEST(Ridges, OfARatioAreKnownWhateverThePriors) {
  const UncertainParameter m = UncertainParameter::Lognormal("m", 1, 0.4).value();
  const UncertainParameter k = UncertainParameter::Uniform("k", 20, 60).value();
  const Problem problem = TextProblem("k/m", {m, k}, 0.01);
  const auto estimator = Processed(problem, {40, 40, 40, 40});
  const Estimate estimate = estimator->CurrentEstimate().value();
  const Exact exact = ByQuadrature(
      [&](double mass) {
        const double z = (std::log(mass) - m.location) / m.scale;
        return std::exp(-0.5 * z * z);
      },
      0.5, 1.5);
  Expect(estimate.parameters[0], exact);
  Expect(estimate.parameters[1],
         {40 * exact.mean, 40 * exact.std_dev, 40 * exact.lower95, 40 * exact.upper95});
  // The most probable logarithm of m is its prior's; of k every value is as probable.
  EXPECT_NEAR(estimate.parameters[0].map, std::exp(m.location), 1e-4);
  EXPECT_NEAR(estimate.parameters[1].map, 40 * std::exp(m.location), 4e-3);
  EXPECT_TRUE(std::ranges::none_of(estimate.diagnostics, [](const Diagnostic& diagnostic) {
    return diagnostic.code == DiagnosticCode::kMultipleMinima ||
           diagnostic.code == DiagnosticCode::kExpansionInaccurate;
  }));
}

}  // namespace
}  // namespace polyest::internal::ridges_test
