#include "proto/wire/convert/problem_limits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/convert/problem.h"
#include "proto/wire/refusal/refusal.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

// Returns the limit that a problem exceeds; empty: none.
std::string Exceeded(const v1::Problem& problem, const ProblemLimits& limits) {
  const auto resolved = ToProblem(problem, {}, limits);
  if (resolved.ok()) return "";
  EXPECT_EQ(resolved.status().code(), absl::StatusCode::kResourceExhausted) << resolved.status();
  const auto refusal = RefusalOf(resolved.status());
  return refusal ? refusal->limit : "none";
}

v1::Problem TwoUnknowns() {
  v1::Problem problem = SmallProblem();
  auto& x0 = *problem.add_uncertain();
  x0.set_name("x0");
  x0.mutable_uniform()->set_lower(-1);
  x0.mutable_uniform()->set_upper(1);
  return problem;
}

TEST(ProblemLimits, AreThoseOfTheCoreByDefault) { EXPECT_EQ(Exceeded(TwoUnknowns(), {}), ""); }

// The names of a problem beyond its model's are looked up and reported one by one.
TEST(ProblemLimits, BoundTheNumberOfNames) {
  v1::Problem problem = TwoUnknowns();
  problem.clear_fixed();
  for (int i = 0; i < 10'001; ++i) (*problem.mutable_fixed())[absl::StrCat("n", i)] = 1;
  const absl::Status refused = ToProblem(problem, {}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(refused.message(), "fixed: 10001 entries are more than there may be, 10000");
  EXPECT_THAT(CheckProblem(problem, {}), testing::ElementsAre(refused));
  problem = TwoUnknowns();
  auto& parameters = *problem.mutable_model()->mutable_equations()->mutable_parameters();
  for (int i = 0; i < 10'001; ++i) parameters[absl::StrCat("n", i)] = 1;
  EXPECT_THAT(std::string(ToProblem(problem, {}).status().message()),
              testing::StartsWith("model.equations.parameters: 10001 entries"));
  // Tables of numbers may be longer.
  problem = TwoUnknowns();
  auto& input = *problem.add_inputs();
  input.set_name("force");
  for (int i = 0; i < 10'001; ++i) {
    input.mutable_table()->add_time_s(0.1 * i);
    input.mutable_table()->add_value(0);
  }
  EXPECT_TRUE(ToProblem(problem, {}).ok());
}

TEST(ProblemLimits, BoundParameters) {
  EXPECT_EQ(Exceeded(TwoUnknowns(), {.parameters = 2}), "");
  EXPECT_EQ(Exceeded(TwoUnknowns(), {.parameters = 1}), "--max-parameters");
}

TEST(ProblemLimits, BoundStates) {
  // The states of mass_spring_damper are displacement and velocity.
  EXPECT_EQ(Exceeded(TwoUnknowns(), {.states = 2}), "");
  EXPECT_EQ(Exceeded(TwoUnknowns(), {.states = 1}), "--max-states");
}

TEST(ProblemLimits, BoundThePointsOfAGivenOrder) {
  v1::Problem problem = TwoUnknowns();
  problem.mutable_expansion()->set_order(3);
  problem.mutable_expansion()->set_points_per_term(3);
  // Order 3 has ten terms in two parameters.
  EXPECT_EQ(Exceeded(problem, {.points = 30}), "");
  EXPECT_EQ(Exceeded(problem, {.points = 29}), "--max-points");
  problem.mutable_expansion()->set_points(v1::ExpansionOptions::GAUSS_TENSOR);
  problem.mutable_expansion()->set_points_per_term(1.2);
  // The tensor grid has (3 + 1)² points.
  EXPECT_EQ(Exceeded(problem, {.points = 16}), "");
  EXPECT_EQ(Exceeded(problem, {.points = 15}), "--max-points");
}

TEST(ProblemLimits, BoundThePointsOfTheHighestOrderThatIsTakenByItself) {
  // The highest order is 9: 55 terms in two parameters.
  EXPECT_EQ(Exceeded(TwoUnknowns(), {.points = 110}), "");
  EXPECT_EQ(Exceeded(TwoUnknowns(), {.points = 109}), "--max-points");
  v1::Problem fixed = TwoUnknowns();
  fixed.mutable_expansion()->set_adaptive(false);
  // The highest order is 3.
  EXPECT_EQ(Exceeded(fixed, {.points = 20}), "");
  EXPECT_EQ(Exceeded(fixed, {.points = 19}), "--max-points");
}

TEST(ProblemLimits, BoundTheParametersThatComeWithRuns) {
  v1::Problem problem = TwoUnknowns();
  problem.mutable_uncertain(1)->set_per_run(true);
  const ProblemLimits limits{.parameters = 3};
  const auto resolved = ToProblem(problem, {}, limits);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  v1::Measurements batch;
  EXPECT_TRUE(CheckRuns(limits, *resolved, batch).ok());
  for (const int run : {0, 1}) batch.add_run(run);
  EXPECT_TRUE(CheckRuns(limits, *resolved, batch).ok());
  batch.add_run(2);
  EXPECT_EQ(RefusalOf(CheckRuns(limits, *resolved, batch))->limit, "--max-parameters");
  // On the way to later runs the parameters of the first ones are together.
  const ProblemLimits more{.parameters = 12};
  for (const int run : {1'000, std::numeric_limits<int>::max() - 1}) {
    batch.set_run(2, run);
    EXPECT_EQ(RefusalOf(CheckRuns(limits, *resolved, batch))->limit, "--max-parameters");
    EXPECT_TRUE(CheckRuns(more, *resolved, batch).ok());
  }
  // The core itself refuses more runs than it can bear, and more than a number holds.
  problem.mutable_expansion()->set_adaptive(false);
  const auto fixed = ToProblem(problem, {}, limits);
  ASSERT_TRUE(fixed.ok()) << fixed.status();
  for (const int run : {1'000, std::numeric_limits<int>::max()}) {
    batch.set_run(2, run);
    EXPECT_TRUE(CheckRuns(limits, *fixed, batch).ok());
  }
}

}  // namespace
}  // namespace polyest::internal
