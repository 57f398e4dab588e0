#include "client/cli/starting_problem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "polyest/catalogue.h"
#include "polyest/problem_file.h"
#include "proto/wire/convert/problem.h"

namespace polyest::internal {
namespace {

using ::testing::IsEmpty;

TEST(StartingProblem, IsValidForEveryModel) {
  for (const auto& model : BuiltinModels()) {
    const ModelDescription& description = model->description();
    const auto problem = ParseProblem(StartingProblem(description), description.name);
    ASSERT_TRUE(problem.ok()) << problem.status();
    EXPECT_THAT(CheckProblem(*problem), IsEmpty()) << description.name;
    EXPECT_EQ(problem->inputs_size(), description.inputs.size());
    EXPECT_EQ(problem->measured_size(), description.outputs.size());
    EXPECT_GE(problem->uncertain_size(), 1);
    // A parameter is left out only if it has no finite default.
    for (const Quantity& parameter : description.parameters) {
      const bool uncertain =
          std::any_of(problem->uncertain().begin(), problem->uncertain().end(),
                      [&](const auto& unknown) { return unknown.name() == parameter.name; });
      EXPECT_EQ(uncertain || problem->fixed().contains(parameter.name),
                std::isfinite(parameter.default_value))
          << description.name << " " << parameter.name;
    }
  }
}

TEST(StartingProblem, MovesAModelThatNothingDrives) {
  const auto model = FindBuiltinModel("pendulum");
  const auto problem = ParseProblem(StartingProblem((*model)->description()), "pendulum");
  ASSERT_TRUE(problem.ok()) << problem.status();
  EXPECT_EQ(problem->fixed().at("theta0"), 0.5);
}

TEST(StartingProblem, AsEquationsIsValid) {
  const auto problem = ParseProblem(kStartingEquations, "equations");
  ASSERT_TRUE(problem.ok()) << problem.status();
  EXPECT_THAT(CheckProblem(*problem), IsEmpty());
}

}  // namespace
}  // namespace polyest::internal
