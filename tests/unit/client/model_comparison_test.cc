// Tests how problems are scored on rows that are held out, by a backend that answers from a table.

#include "client/cli/model_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/client/table_backend.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TableBackend Backend() {
  return TableBackend([](const v1::Problem&) { return -30.0; });
}

TEST(ModelComparisonTest, EstimatesFromTheFirstRowsAndScoresTheOthers) {
  TableBackend backend = Backend();
  Assessment assessment;
  ASSERT_TRUE(Score(Oscillator(), {.fraction = 0.3}, backend, assessment).ok());
  EXPECT_EQ(assessment.held_out, 3);
  EXPECT_NEAR(assessment.log_score, -3, 1e-12);
  EXPECT_THAT(assessment.doubts, IsEmpty());
  const v1::PredictRequest& request = backend.scored()[0];
  EXPECT_THAT(request.subject().experiment().measurements().time_s(),
              ElementsAre(10, 20, 30, 40, 50, 60, 70));
  EXPECT_EQ(request.record().time_s_size(), 10);
  EXPECT_EQ(request.first_scored_row(), 7);
  EXPECT_TRUE(request.same_runs());  // what was estimated of a run serves for its other rows
}

TEST(ModelComparisonTest, OnlyFiltersHaveAHorizon) {
  TableBackend backend = Backend();
  v1::Experiment pushed = Oscillator(), drifting = Oscillator(), stated = Oscillator();
  pushed.mutable_problem()->add_process_noise()->set_state("v");
  drifting.mutable_problem()->mutable_uncertain(0)->mutable_drift()->mutable_random_walk();
  stated.mutable_problem()->set_likelihood(v1::Problem::PREDICTION_ERROR);
  std::vector<double> horizons_s;
  for (const v1::Experiment& experiment : {Oscillator(), pushed, drifting, stated}) {
    Assessment assessment;
    ASSERT_TRUE(Score(experiment, {.fraction = 0.3, .horizon_s = 5}, backend, assessment).ok());
    horizons_s.push_back(backend.scored().back().horizon_s());
  }
  EXPECT_THAT(horizons_s, ElementsAre(0, 5, 5, 5));
}

TEST(ModelComparisonTest, SaysWhenAScoreIsNotToBeBelieved) {
  TableBackend backend = Backend();
  backend.RaiseDiagnostics({v1::Diagnostic::NON_GAUSSIAN, v1::Diagnostic::EXPANSION_INACCURATE});
  Assessment assessment;
  ASSERT_TRUE(Score(Oscillator(), {}, backend, assessment).ok());
  EXPECT_THAT(assessment.doubts, ElementsAre(v1::Diagnostic::EXPANSION_INACCURATE));
}

TEST(ModelComparisonTest, NeedsRowsOnBothSides) {
  TableBackend backend = Backend();
  Assessment assessment;
  for (const auto& [fraction, missing] : {std::pair{0.99, "estimate from"}, {0.01, "predict"}}) {
    EXPECT_THAT(Score(Oscillator(), {.fraction = fraction}, backend, assessment).message(),
                HasSubstr(missing));
  }
}

}  // namespace
}  // namespace polyest::internal
