// Tests expansions of automatic order: no more than is needed, enough where it is needed.

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <numbers>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::automatic_order_test {
namespace {

constexpr double kNoise = 0.4;

// Makes a problem with so few and poor samples of exp(sin(3 a)) that the posterior stays as wide as
// the prior. No cubic follows the output over that width. Other parameters, which change nothing,
// make so many dimensions that elements are not bisected.
Problem WideProblem(std::optional<int> order, int others = 4) {
  std::vector<UncertainParameter> parameters = {UncertainParameter::Uniform("a", -0.5, 1).value()};
  std::string output = "exp(sin(3*a))";
  for (int i = 0; i < others; ++i) {
    const std::string name = absl::StrCat("b", i);
    parameters.push_back(UncertainParameter::Uniform(name, 0, 1).value());
    absl::StrAppend(&output, " + 0*", name);
  }
  Problem problem = TextProblem(output, parameters, kNoise);
  problem.expansion.order = order;
  return problem;
}

std::vector<double> FewSamples() { return {2.1, 2.6, 2.9}; }

struct Moments {
  double mean = 0;
  double std_dev = 0;
};

// Integrates by the trapezoidal rule on the model itself.
Moments Exact() {
  constexpr int kNodes = 20'001;
  double mass = 0, first = 0, second = 0;
  for (int i = 0; i < kNodes; ++i) {
    const double a = -0.5 + 1.5 * i / (kNodes - 1);
    double cost = 0;
    for (const double z : FewSamples()) {
      cost += 0.5 * std::pow((z - std::exp(std::sin(3 * a))) / kNoise, 2);
    }
    const double weight = std::exp(-cost) * (i == 0 || i == kNodes - 1 ? 0.5 : 1);
    mass += weight;
    first += weight * a;
    second += weight * a * a;
  }
  return {first / mass, std::sqrt(second / mass - std::pow(first / mass, 2))};
}

TEST(AutomaticOrder, RisesWhereTheFirstOrderDoesNotFollowTheModel) {
  const Moments exact = Exact();
  const Estimate fixed = Processed(WideProblem(3), FewSamples())->CurrentEstimate().value();
  const Estimate automatic =
      Processed(WideProblem(std::nullopt), FewSamples())->CurrentEstimate().value();
  EXPECT_EQ(fixed.expansion.order, 3);
  EXPECT_GT(automatic.expansion.order, 3);
  EXPECT_LT(automatic.expansion.residual_to_noise, fixed.expansion.residual_to_noise);
  EXPECT_FALSE(Has(automatic, DiagnosticCode::kExpansionInaccurate));
  EXPECT_NEAR(automatic.parameters[0].mean, exact.mean, 0.03 * exact.std_dev);
  EXPECT_NEAR(automatic.parameters[0].posterior_std_dev, exact.std_dev, 0.03 * exact.std_dev);
}

// In few dimensions elements are bisected instead, whether the order may rise or not.
TEST(AutomaticOrder, NeedNotRiseWhereElementsAreBisected) {
  const Moments exact = Exact();
  const Estimate estimate = Processed(WideProblem(3, 0), FewSamples())->CurrentEstimate().value();
  EXPECT_EQ(estimate.expansion.order, 3);
  EXPECT_TRUE(estimate.components.empty());
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kExpansionInaccurate));
  EXPECT_NEAR(estimate.parameters[0].mean, exact.mean, 0.03 * exact.std_dev);
  EXPECT_NEAR(estimate.parameters[0].posterior_std_dev, exact.std_dev, 0.03 * exact.std_dev);
}

TEST(AutomaticOrder, StaysWhereTheFirstOrderIsEnough) {
  Problem problem =
      InitialVelocityProblem(UncertainParameter::Uniform("v0", 0.5, 1.5).value(), 0.1);
  problem.expansion.order.reset();
  std::vector<double> times;
  for (int k = 1; k <= 40; ++k) times.push_back(0.1 * k);
  const Estimate estimate = EstimateOf(problem, InitialVelocityRecord(times, 1.2, 0.1));
  EXPECT_EQ(estimate.expansion.order, 3);
}

// The output has thirteen periods over the prior, more than a polynomial of order 9 follows. The
// data allow values in all of them. There are too many dimensions to bisect elements.
TEST(AutomaticOrder, SaysWhenNothingAffordableSuffices) {
  std::vector<UncertainParameter> parameters;
  for (const char* name : {"a", "b", "c", "d"}) {
    parameters.push_back(UncertainParameter::Uniform(name, -1, 1).value());
  }
  const Problem problem = TextProblem("sin(40*a) + 0*(b + c + d)", parameters, 0.2);
  const Estimate estimate = Processed(problem, {0.5, 0.45, 0.55})->CurrentEstimate().value();
  EXPECT_THAT(Message(estimate, DiagnosticCode::kExpansionInaccurate),
              ::testing::HasSubstr("narrower priors or more informative data"));
  ExpectFinite(estimate);
}

// The output y = sum of theta_i cos(i t) is linear, so that least squares with the prior's rows is
// exact.
class TwelveParameters : public ::testing::TestWithParam<double> {};

TEST_P(TwelveParameters, AreEstimatedAsByLeastSquares) {
  constexpr int kParameters = 12;
  std::string output;
  std::vector<UncertainParameter> uncertain;
  for (int i = 0; i < kParameters; ++i) {
    const std::string name = "p" + std::to_string(i);
    output += (i > 0 ? " + " : "") + name + "*cos(" + std::to_string(i) + "*t)";
    uncertain.push_back(UncertainParameter::Normal(name, 0, 1).value());
  }
  Problem problem = TextProblem(output, uncertain, 0.1);
  problem.expansion.hyperbolic_exponent = GetParam();
  Matrix information = Matrix::Identity(kParameters, kParameters);
  Vector right = Vector::Zero(kParameters);
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int k = 0; k < 60; ++k) {
    const double t = 0.05 * k;
    Vector row(kParameters);
    for (int i = 0; i < kParameters; ++i) row[i] = std::cos(i * t);
    const double z = 0.5 * row.sum() + 0.1 * std::sin(17.0 * k);
    samples.time_s.push_back(t);
    samples.columns[0].value.push_back(z);
    information += row * row.transpose() / 0.01;
    right += row * z / 0.01;
  }
  const Eigen::LLT<Matrix> factor(information);
  const Vector exact = factor.solve(right);
  const Matrix covariance = factor.solve(Matrix::Identity(kParameters, kParameters));
  const Estimate estimate = EstimateOf(problem, samples);
  for (int i = 0; i < kParameters; ++i) {
    const double std_dev = std::sqrt(covariance(i, i));
    EXPECT_NEAR(estimate.parameters[static_cast<size_t>(i)].map, exact[i], 1e-3 * std_dev) << i;
    EXPECT_NEAR(estimate.parameters[static_cast<size_t>(i)].std_dev, std_dev, 1e-3 * std_dev) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(TotalDegreeAndHyperbolic, TwelveParameters, ::testing::Values(1.0, 0.75));

}  // namespace
}  // namespace polyest::internal::automatic_order_test
