// What an assessment says of the bounds of its component's element.

#include "core/estimator/posterior/assessment.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "core/estimator/expansion/replay.h"
#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/record/memory_store.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::assessment_test {
namespace {

// y = a with the prior N(0, 1); a sample of 1 with a standard deviation of 1 leaves N(0.5, 0.5) for
// the one unknown.
class OneUnknown : public ::testing::Test {
 protected:
  // Whether the assessment of an element up to `bound` says that the posterior goes on beyond it.
  bool GoesOn(double bound, const std::optional<std::vector<const Element*>>& others) {
    ExpansionDesign design = DesignForPrior(problem_).value();
    design.element = Element().Divide(Vector::Ones(1), bound).first;
    RowBlock block;
    block.rows.push_back({0, 1.0});
    block.values = {1};
    block.noise = {1};
    MemoryStore store;
    EXPECT_TRUE(store.Append(block).ok());
    const auto expansion =
        Replay(problem_, design, NoiseToBeginWith(problem_.problem()), store, 1, 1, Stop()).value();
    RecordSummary record;
    record.Add(block, 0, 1);
    const Matrix guesses(0, 1);
    AssessmentRequest request;
    request.problem = &problem_;
    request.expansion = expansion.get();
    request.record = &record;
    request.guesses = &guesses;
    request.others = others;
    return Assess(request, Stop()).value().findings.leans;
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

}  // namespace
}  // namespace polyest::internal::assessment_test
