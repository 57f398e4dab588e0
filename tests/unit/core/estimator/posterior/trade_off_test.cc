// Tests combinations of parameters that are known although the parameters are not.

#include "core/estimator/posterior/trade_off.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kJointDraws = 4'000;

// Finds the trade-offs between draws of a, spread by 20 %, and of b = known(a) with a spread of 0.1
// %.
template <class Function>
std::vector<TradeOff> TradeOffsOf(Function known, const std::string& unit,
                                  Verdict verdict = Verdict::kNotIdentified) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  Matrix thetas(kJointDraws, 2);
  for (int i = 0; i < kJointDraws; ++i) {
    thetas(i, 0) = 10 * std::exp(0.2 * normal(random));
    thetas(i, 1) = known(thetas(i, 0)) * (1 + 0.001 * normal(random));
  }
  const Vector weights = Vector::Constant(kJointDraws, 1.0 / kJointDraws);
  return FindTradeOffs(thetas, weights, {"a", "b"}, {"kg", unit}, {verdict, verdict});
}

TEST(TradeOffs, AreTheCombinationThatIsKnown) {
  struct Case {
    std::string combination;
    double (*known)(double);
  };
  for (const Case& c :
       {Case{"a/b", [](double a) { return 3 * a; }}, Case{"a·b", [](double a) { return 5 / a; }},
        Case{"a/b²", [](double a) { return std::sqrt(a); }},
        Case{"a·√b", [](double a) { return 1 / (a * a); }}}) {
    const auto found = TradeOffsOf(c.known, "s");
    ASSERT_EQ(found.size(), 1u) << c.combination;
    EXPECT_EQ(found[0].combination, c.combination);
    EXPECT_LT(found[0].relative_std_dev, 0.0025);
  }
}

TEST(TradeOffs, AddOnlyWhatHasTheSameUnit) {
  // The complement is positive, because 20 % of 10 is far from 40.
  const auto complement = [](double a) { return 40 - a; };
  const auto same = TradeOffsOf(complement, "kg");
  ASSERT_EQ(same.size(), 1u);
  EXPECT_EQ(same[0].combination, "a + b");
  EXPECT_TRUE(TradeOffsOf(complement, "s").empty());
}

TEST(TradeOffs, AreNotLookedForAmongIdentifiedParameters) {
  EXPECT_TRUE(TradeOffsOf([](double a) { return 3 * a; }, "s", Verdict::kIdentified).empty());
}

// A free vibration tells the frequency, but neither stiffness nor mass.
TEST(TradeOffs, ExplainTheValleyOfStiffnessAndMass) {
  Problem problem = InitialVelocityProblem(UncertainParameter::Normal("k", 4, 1).value(), 0.001);
  problem.uncertain.push_back(UncertainParameter::Normal("m", 0.1, 0.005).value());
  problem.fixed["v0"] = 1;
  std::vector<double> times;
  for (int i = 1; i <= 60; ++i) times.push_back(0.05 * i);
  const Estimate estimate = EstimateOf(problem, InitialVelocityRecord(times, 1, 0.001));
  ASSERT_EQ(estimate.trade_offs.size(), 1u);
  EXPECT_EQ(estimate.trade_offs[0].combination, "k/m");
  EXPECT_LT(estimate.trade_offs[0].relative_std_dev, 0.01);
  EXPECT_THAT(Message(estimate, DiagnosticCode::kNotIdentified),
              AllOf(HasSubstr("; k/m is known to "), HasSubstr("k and m separately only to ")));
}

}  // namespace
}  // namespace polyest::internal
