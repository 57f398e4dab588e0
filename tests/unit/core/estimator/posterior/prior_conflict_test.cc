// Tests that estimates say where data and prior contradict each other.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> Conflicts(const Problem& problem, const std::vector<double>& values) {
  std::vector<std::string> messages;
  const Estimate estimate = Processed(problem, values)->CurrentEstimate().value();
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    if (diagnostic.code == DiagnosticCode::kPriorDataConflict) {
      messages.push_back(diagnostic.message);
    }
  }
  return messages;
}

// Ten samples whose mean is `mean` and whose spread is that of their noise of 1.
std::vector<double> About(double mean) {
  std::vector<double> values;
  for (const double e : {1.3, -0.4, 0.6, -1.2, 0.2, -0.9, 1.1, -0.7, 0.5, -0.5}) {
    values.push_back(mean + e);
  }
  return values;
}

UncertainParameter StandardNormal() { return UncertainParameter::Normal("a", 0, 1).value(); }

// With N samples of the noise 1, the data alone say ȳ ± 1/√N: they are ȳ/√(1 + 1/N) standard
// deviations of both from the prior.
TEST(PriorConflict, IsTheDistanceOfDataAndPrior) {
  const Problem problem = TextProblem("a + 0*t", {StandardNormal()}, 1);
  EXPECT_THAT(Conflicts(problem, About(5.5)),
              ElementsAre(AllOf(HasSubstr("prior of a differ"), HasSubstr(" by 5.24 combined"))));
  EXPECT_THAT(Conflicts(problem, About(-4.5)), ElementsAre(HasSubstr(" by 4.29 combined")));
  EXPECT_THAT(Conflicts(problem, About(3.9)), IsEmpty());  // 3.72
}

TEST(PriorConflict, IsMeasuredInLogarithmsOfALognormalParameter) {
  // log a ~ N(0, 0.1²): its mean and standard deviation are those of the lognormal.
  const double mean = std::exp(0.005);
  const double deviation = mean * std::sqrt(std::expm1(0.01));
  const Problem problem = TextProblem(
      "100*log(a) + 0*t", {UncertainParameter::Lognormal("a", mean, deviation).value()}, 1);
  EXPECT_THAT(Conflicts(problem, About(55)), ElementsAre(HasSubstr(" by 5.5 combined")));
  EXPECT_THAT(Conflicts(problem, About(35)), IsEmpty());
}

TEST(PriorConflict, DoesNotArise) {
  // No value of a uniform prior is less probable than another.
  EXPECT_THAT(
      Conflicts(TextProblem("a + 0*t", {UncertainParameter::Uniform("a", -10, 10).value()}, 1),
                About(9.5)),
      IsEmpty());
  // A parameter on a bound is reported as such.
  EXPECT_THAT(
      Conflicts(TextProblem("a + 0*t",
                            {UncertainParameter::TruncatedNormal("a", 0, 1, -2, 2).value()}, 1),
                About(9)),
      IsEmpty());
  // A prior of a hundredth of its weight has ten times its standard deviation.
  Problem weighted = TextProblem("a + 0*t", {StandardNormal()}, 1);
  weighted.regularization = 0.01;
  EXPECT_THAT(Conflicts(weighted, About(9)), IsEmpty());
}

// Each parameter is 2.5 standard deviations from its mean, but their correlation has them on one
// side.
TEST(PriorConflict, IsFoundOfAllParametersTogether) {
  Problem problem = TextProblem(
      "a + b*t", {StandardNormal(), UncertainParameter::Normal("b", 0, 1).value()}, 0.01);
  std::vector<double> values;  // at t = 1, 2, …
  for (int k = 1; k <= 20; ++k) values.push_back(2.5 - 2.5 * k + 0.01 * std::cos(2.0 * k));
  EXPECT_THAT(Conflicts(problem, values), IsEmpty());
  problem.correlations = {{"a", "b", 0.9}};
  EXPECT_THAT(Conflicts(problem, values), ElementsAre(HasSubstr("together")));
}

}  // namespace
}  // namespace polyest::internal
