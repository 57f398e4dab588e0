// Which quantities of a problem count as fixed.

#include "core/estimator/studies/fixed_quantities.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;

Problem Oscillator() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 2}, {"x.gain", 1.5}};
  problem.uncertain = {UncertainParameter::Uniform("k", 30, 50).value()};
  problem.measured = {{"x", {.absolute = 0.002}}};
  return problem;
}

std::vector<std::string> NamesOf(const Problem& problem) {
  std::vector<std::string> names;
  const ResolvedProblem resolved = ResolvedProblem::Make(problem).value();
  for (const FixedQuantity& quantity : FixedQuantitiesOf(resolved, 0.1)) {
    names.push_back(quantity.name);
  }
  return names;
}

TEST(FixedQuantities, AreThoseOfMeasuredOutputsAndOfTheModel) {
  EXPECT_THAT(NamesOf(Oscillator()),
              ElementsAre("x.gain", "x.delay", "x.offset", "m", "c", "x0", "v0"));
}

TEST(FixedQuantities, AreThoseOfDrivenInputsToo) {
  Problem problem = Oscillator();
  problem.inputs = {{"force", ConstantInput{}}};
  EXPECT_THAT(NamesOf(problem), ElementsAre("force.gain", "force.delay", "force.offset", "x.gain",
                                            "x.delay", "x.offset", "m", "c", "x0", "v0"));
}

TEST(FixedQuantities, AreNotThoseThatAreUncertainOrDerived) {
  Problem problem = Oscillator();
  problem.uncertain.push_back(UncertainParameter::Normal("x.offset", 0, 1).value());
  problem.derived = {{"c", "0.01*k"}};
  EXPECT_THAT(NamesOf(problem), ElementsAre("x.gain", "x.delay", "m", "x0", "v0"));
}

TEST(FixedQuantities, HaveTheValuesOfTheProblemOrTheModel) {
  const ResolvedProblem problem = ResolvedProblem::Make(Oscillator()).value();
  const std::vector<FixedQuantity> quantities = FixedQuantitiesOf(problem, 0.1);
  const auto find = [&](const char* name) {
    return *std::ranges::find(quantities, name, &FixedQuantity::name);
  };
  EXPECT_EQ(find("m").value, 2);
  EXPECT_EQ(find("x.gain").value, 1.5);
  EXPECT_EQ(find("v0").value, 0);
  EXPECT_EQ(find("x.delay").delayed_channel, 0);
  EXPECT_LE(find("x.delay").max_step, 0.1);
}

TEST(FixedQuantities, BecomeUncertainAfterTheOthers) {
  const ResolvedProblem problem = ResolvedProblem::Make(Oscillator()).value();
  const auto extended = WithUncertain(problem, FixedQuantitiesOf(problem, 0.1));
  ASSERT_TRUE(extended.has_value());
  EXPECT_THAT(extended->prior().Names(),
              ElementsAre("k", "x.gain", "x.delay", "x.offset", "m", "c", "x0", "v0"));
}

}  // namespace
}  // namespace polyest::internal
