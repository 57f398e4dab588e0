// What an assessment says of the bounds of its component's element.

#include "core/estimator/posterior/assessment.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/record/memory_store.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::assessment_test {
namespace {

// Returns the assessment of an expansion of this design that has taken the values of one output.
Assessed AssessedOn(const ResolvedProblem& problem, const ExpansionDesign& design,
                    const std::vector<double>& values,
                    const std::optional<std::vector<const Element*>>& others) {
  RowBlock block;
  block.values = values;
  block.noise.assign(values.size(), problem.problem().measured.front().noise.absolute);
  RecordSummary record;
  for (size_t i = 0; i < values.size(); ++i) {
    block.rows.push_back({0, static_cast<double>(i + 1)});
  }
  for (int row = 0; row < block.count(); ++row) record.Add(block, row, 1);
  MemoryStore store;
  EXPECT_TRUE(store.Append(block).ok());
  const auto expansion =
      Replay(problem, design, NoiseToBeginWith(problem.problem()), store, block.count(), 1, Stop())
          .value();
  const Matrix guesses(0, problem.dimension());
  AssessmentRequest request;
  request.problem = &problem;
  request.expansion = expansion.get();
  request.record = &record;
  request.guesses = &guesses;
  request.others = others;
  return Assess(request, Stop()).value();
}

// y = a with the prior N(0, 1); a sample of 1 with a standard deviation of 1 leaves N(0.5, 0.5) for
// the one unknown.
class OneUnknown : public ::testing::Test {
 protected:
  // Whether the assessment of an element up to `bound` says that the posterior goes on beyond it.
  bool GoesOn(double bound, const std::optional<std::vector<const Element*>>& others) {
    ExpansionDesign design = DesignForPrior(problem_).value();
    design.element = Element().Divide(Vector::Ones(1), bound).first;
    return AssessedOn(problem_, design, {1}, others).findings.leans;
  }

  const ResolvedProblem problem_ =
      ResolvedProblem::Make(TextProblem("a", {UncertainParameter::Normal("a", 0, 1).value()}, 1))
          .value();
};

TEST_F(OneUnknown, GoesOnBeyondABoundThatCutsThePosterior) {
  EXPECT_TRUE(GoesOn(0.5, {{}}));
  EXPECT_TRUE(GoesOn(0, {{}}));
}

TEST_F(OneUnknown, EndsBeforeABoundThatIsFarAway) { EXPECT_FALSE(GoesOn(3, {{}})); }

TEST_F(OneUnknown, GoesOnInTheElementBeyondTheBound) {
  const Element beyond = Element().Divide(Vector::Ones(1), 0.5).second;
  EXPECT_FALSE(GoesOn(0.5, {{&beyond}}));
}

// As where trajectories could not be integrated.
TEST_F(OneUnknown, IsNotFollowedWhereItIsNotLookedAt) { EXPECT_FALSE(GoesOn(0.5, std::nullopt)); }

// An expansion that does not follow the model widens the draws beyond its region, where it has
// residuals that are not those of the record.
TEST(NoiseOfAnAssessment, IsThatOfTheRecordWhereTheDrawsAreWidened) {
  Problem wave =
      TextProblem("a + sin(300*a)/10", {UncertainParameter::Normal("a", 0, 100).value()}, 0.05);
  wave.measured.front().noise.unknown = true;
  const ResolvedProblem problem = ResolvedProblem::Make(wave).value();
  std::vector<double> values;
  for (int i = 0; i < 400; ++i) values.push_back(i % 2 == 0 ? 0.05 : -0.05);
  ExpansionDesign design =
      DesignForRegion(problem, Truncation{.order = 2},
                      Region(Vector::Zero(1), Matrix::Constant(1, 1, 0.004)), Vector::Zero(1));
  SpreadCheckPoints(problem, Vector::Zero(1), design);
  const Assessed assessed = AssessedOn(problem, design, values, std::nullopt);
  EXPECT_GT(assessed.findings.shift, 3);
  EXPECT_LT(assessed.estimate.channels[0].noise_std_dev, 0.2);
}

}  // namespace
}  // namespace polyest::internal::assessment_test
