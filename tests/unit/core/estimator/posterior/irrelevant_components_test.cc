// Components far from the data, in which something contradicts the expansion or the residuals.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::irrelevant_components_test {
namespace {

using ::testing::IsEmpty;

struct Case {
  double prior_std_dev = 1;  // of a lognormal prior with mean 1
  double noise = 1;
  std::vector<double> values;  // of y = a
};

struct Moments {
  double mean = 0;
  double std_dev = 0;
};

// Integrates the posterior of y = a over ln a by the trapezoidal rule, within 12 standard
// deviations of the prior. Its error with 20,001 points is that of rounding.
Moments ByQuadrature(const Case& one) {
  constexpr int kPoints = 20'001;
  const double variance = std::log1p(one.prior_std_dev * one.prior_std_dev);
  std::vector<double> a, log_density;
  for (int i = 0; i < kPoints; ++i) {
    const double z = -12 + 24.0 * i / (kPoints - 1);
    a.push_back(std::exp(-0.5 * variance + z * std::sqrt(variance)));
    double sum = -0.5 * z * z;
    for (const double y : one.values) sum -= 0.5 * std::pow((y - a.back()) / one.noise, 2);
    log_density.push_back(sum);
  }
  const double largest = *std::ranges::max_element(log_density);
  double mass = 0, first = 0, second = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double density = std::exp(log_density[i] - largest);
    mass += density;
    first += density * a[i];
    second += density * a[i] * a[i];
  }
  const double mean = first / mass;
  return {mean, std::sqrt(second / mass - mean * mean)};
}

class IrrelevantComponents : public ::testing::TestWithParam<Case> {};

// The bound is for the weights of elements by bridge sampling with some thousand draws, whose
// relative error is about 10⁻², and for the errors of expansions that are called accurate.
TEST_P(IrrelevantComponents, LeaveMeanAndStandardDeviationThoseOfQuadrature) {
  const Case& one = GetParam();
  const Problem problem = TextProblem(
      "a", {UncertainParameter::Lognormal("a", 1, one.prior_std_dev).value()}, one.noise);
  const Estimate estimate = Processed(problem, one.values)->CurrentEstimate().value();
  const Moments exact = ByQuadrature(one);
  EXPECT_NEAR(estimate.parameters[0].mean, exact.mean, 0.05 * exact.std_dev);
  EXPECT_NEAR(estimate.parameters[0].posterior_std_dev, exact.std_dev, 0.05 * exact.std_dev);
  EXPECT_THAT(estimate.components, IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(FewSamples, IrrelevantComponents,
                         ::testing::Values(Case{5, 0.3, {0.5}}, Case{2, 0.3, {0.1}},
                                           Case{5, 0.3, {3.0}}, Case{2, 3, {0.9, 1.5}}));

// An expansion over elements too wide for the noise cannot use the datum, and the answer is the
// prior: in all of its parts.
TEST(UnusedData, LeaveTheCovarianceOfThePrior) {
  const Problem problem = TextProblem("a", {UncertainParameter::Lognormal("a", 1, 2).value()}, 0.3);
  const Estimate estimate = Processed(problem, {3.0})->CurrentEstimate().value();
  const ParameterEstimate& a = estimate.parameters[0];
  EXPECT_NEAR(std::sqrt(estimate.covariance(0, 0)), a.std_dev, 1e-12);
  EXPECT_EQ(estimate.directions[0].verdict, a.verdict);
}

}  // namespace
}  // namespace polyest::internal::irrelevant_components_test
