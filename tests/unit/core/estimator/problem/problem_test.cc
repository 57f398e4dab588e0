#include "core/estimator/problem/resolved_problem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "core/estimator/problem/truncation.h"
#include "polyest/catalogue.h"

namespace polyest::internal::problem_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Problem Good() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 2}};
  problem.uncertain = {UncertainParameter::Uniform("k", 3, 5).value(),
                       UncertainParameter::Normal("force.amplitude", 10, 1).value()};
  problem.inputs = {{"force", SinusoidInput{.amplitude = 7}}};
  problem.measured = {{"v", {.absolute = 0.1}}, {"x", {.relative = 0.1}}};
  return problem;
}

std::string Refusal(const std::function<void(Problem&)>& change,
                    absl::StatusCode code = absl::StatusCode::kInvalidArgument) {
  Problem problem = Good();
  change(problem);
  const auto resolved = ResolvedProblem::Make(std::move(problem));
  EXPECT_EQ(resolved.status().code(), code) << resolved.status();
  return std::string(resolved.status().message());
}

TEST(ResolvedProblem, FindsColumnsAndUnits) {
  const ResolvedProblem problem = ResolvedProblem::Make(Good()).value();
  EXPECT_EQ(problem.dimension(), 2);
  EXPECT_EQ(problem.channels(), 2);
  EXPECT_THAT(problem.outputs(), ElementsAre(1, 0));
  EXPECT_THAT(problem.units(), ElementsAre("N/m", "N"));
  EXPECT_THAT(problem.streamed_inputs(), ::testing::IsEmpty());
}

TEST(ResolvedProblem, PutsEveryValueIntoItsColumn) {
  const ResolvedProblem problem = ResolvedProblem::Make(Good()).value();
  Matrix thetas(2, 2);
  thetas << 3.5, 11, 4.5, 12;
  const EnsembleSpecification ensemble = problem.MakeEnsemble(thetas, {2}, 2);
  ASSERT_EQ(ensemble.parameters.rows(), 2);
  ASSERT_EQ(ensemble.parameters.cols(), 5);  // m, c, k, x0, v0
  Matrix parameters(2, 5);
  parameters << 2, 0, 3.5, 0, 0, 2, 0, 4.5, 0, 0;
  EXPECT_EQ(ensemble.parameters, parameters);
  EXPECT_EQ(ensemble.amplitudes, thetas.col(1));
  EXPECT_THAT(ensemble.outputs, ElementsAre(2));
  EXPECT_EQ(ensemble.threads, 2);
}

TEST(ResolvedProblem, TakesAmplitudesFromFixedBeforeTheSignalsOwn) {
  Problem problem = Good();
  problem.uncertain.pop_back();
  EXPECT_EQ(ResolvedProblem::Make(problem)->MakeEnsemble(Matrix::Ones(1, 1), {}, 1).amplitudes,
            Matrix::Constant(1, 1, 7));
  problem.fixed["force.amplitude"] = 9;
  EXPECT_EQ(ResolvedProblem::Make(problem)->MakeEnsemble(Matrix::Ones(1, 1), {}, 1).amplitudes,
            Matrix::Constant(1, 1, 9));
}

TEST(ResolvedProblem, AnswersAnUnknownNameWithTheNamesThereAre) {
  EXPECT_EQ(Refusal([](Problem& p) { p.fixed["mass"] = 1; }),
            "fixed.mass: model mass_spring_damper has no parameter \"mass\"; it has m, c, k, x0, "
            "v0, {force}.{amplitude, gain, delay, offset}, {x, v, a}.{gain, delay, offset}");
  EXPECT_EQ(Refusal([](Problem& p) { p.uncertain[0].name = "stiffness"; }),
            "uncertain[0]: model mass_spring_damper has no parameter \"stiffness\"; it has m, c, "
            "k, x0, v0, {force}.{amplitude, gain, delay, offset}, {x, v, a}.{gain, delay, offset}");
  EXPECT_EQ(Refusal([](Problem& p) { p.inputs[0].name = "torque"; }),
            "inputs[0]: model mass_spring_damper has no input \"torque\"; it has force");
  EXPECT_EQ(Refusal([](Problem& p) { p.measured[1].output = "y"; }),
            "measured[1]: model mass_spring_damper has no output \"y\"; it has x, v, a");
}

TEST(ResolvedProblem, SuggestsTheNameThatIsProbablyMeant) {
  EXPECT_EQ(Refusal([](Problem& p) { p.fixed["force.amplitud"] = 1; }),
            "fixed.force.amplitud: model mass_spring_damper has no parameter \"force.amplitud\"; "
            "did you mean \"force.amplitude\"?");
  EXPECT_EQ(Refusal([](Problem& p) { p.uncertain[0].name = "K"; }),
            "uncertain[0]: model mass_spring_damper has no parameter \"K\"; did you mean \"k\"?");
  EXPECT_EQ(Refusal([](Problem& p) { p.inputs[0].name = "froce"; }),
            "inputs[0]: model mass_spring_damper has no input \"froce\"; did you mean \"force\"?");
  EXPECT_EQ(Refusal([](Problem& p) { p.measured[1].output = "X"; }),
            "measured[1]: model mass_spring_damper has no output \"X\"; did you mean \"x\"?");
}

TEST(ResolvedProblem, RefusesANameGivenTwice) {
  EXPECT_EQ(Refusal([](Problem& p) { p.uncertain[1].name = "k"; }),
            "uncertain[1]: k is given twice");
  EXPECT_EQ(Refusal([](Problem& p) { p.measured[1].output = "v"; }),
            "measured[1]: output v is given twice");
  EXPECT_EQ(Refusal([](Problem& p) { p.inputs.push_back(p.inputs[0]); }),
            "inputs[1]: input force is given twice");
}

TEST(ResolvedProblem, RefusesWhatIsBothFixedAndUncertain) {
  EXPECT_EQ(Refusal([](Problem& p) { p.fixed["k"] = 4; }),
            "uncertain[0]: k is both fixed and uncertain");
}

TEST(ResolvedProblem, RefusesAnUncertainAmplitudeWithoutASignal) {
  EXPECT_EQ(Refusal([](Problem& p) { p.inputs.clear(); }),
            "uncertain[1]: force.amplitude needs a signal for input force in inputs");
}

TEST(ResolvedProblem, PassesOnWhatIsWrongWithASignal) {
  EXPECT_THAT(Refusal([](Problem& p) { p.inputs[0].signal = SinusoidInput{.frequency_hz = 0}; }),
              StartsWith("inputs[0].sinusoid."));
}

TEST(ResolvedProblem, NeedsAModelAndSomethingUncertain) {
  EXPECT_EQ(Refusal([](Problem& p) { p.model = nullptr; }), "model: a model must be given");
  EXPECT_EQ(Refusal([](Problem& p) { p.uncertain.clear(); }),
            "uncertain: at least one parameter must be uncertain");
}

TEST(ResolvedProblem, NeedsNoMeasuredOutput) {
  Problem problem = Good();
  problem.measured.clear();
  EXPECT_TRUE(ResolvedProblem::Make(problem).ok());
}

TEST(ResolvedProblem, LimitsTheNumberOfTerms) {
  EXPECT_EQ(
      Refusal([](Problem& p) { p.expansion.order = 100; }, absl::StatusCode::kResourceExhausted),
      "expansion.order: order 100 of 2 uncertain parameters needs more than 2000 terms, the "
      "limit");
}

TEST(ResolvedProblem, AnAutomaticOrderBeginsWithWhatIsAffordable) {
  EXPECT_EQ(FirstTruncation({}, 2).order, 3);
  EXPECT_EQ(FirstTruncation({}, 9).order, 3);                              // 220 terms
  EXPECT_EQ(FirstTruncation({}, 10).order, 2);                             // 286 of order 3
  EXPECT_EQ(FirstTruncation({.hyperbolic_exponent = 0.75}, 12).order, 3);  // 103 terms
  EXPECT_EQ(FirstTruncation({.order = 3}, 12).order, 3);
}

TEST(ResolvedProblem, AnAutomaticOrderRisesAsFarAsThatIsAffordable) {
  EXPECT_EQ(NextTruncation({}, 1, {3, 1})->order, 5);
  EXPECT_EQ(NextTruncation({}, 1, {8, 1})->order, 9);
  EXPECT_FALSE(NextTruncation({}, 1, {9, 1}));
  EXPECT_EQ(NextTruncation({}, 12, {2, 1})->order, 3);  // 455 terms
  EXPECT_FALSE(NextTruncation({}, 12, {3, 1}));         // 1820 of order 4
  EXPECT_EQ(NextTruncation({}, 10, {2, 1})->order, 3);  // 286 terms
  EXPECT_EQ(NextTruncation({}, 10, {3, 1})->order, 4);  // 1001 terms
  EXPECT_FALSE(NextTruncation({}, 13, {2, 1}));         // 560 of order 3
  EXPECT_FALSE(NextTruncation({}, 4, {8, 1}));          // 715 of order 9
  EXPECT_FALSE(NextTruncation({.order = 3}, 1, {3, 1}));
}

TEST(ResolvedProblem, LimitsTheNumberOfPoints) {
  EXPECT_EQ(Refusal(
                [](Problem& p) {
                  p.expansion.order = 1;
                  p.expansion.points_per_term = 1e4;
                },
                absl::StatusCode::kResourceExhausted),
            "expansion: 30000 collocation points are needed; the limit is 20000");
}

TEST(ResolvedProblem, RefusesExpansionsThatAreNone) {
  for (const double bad : {0.0, -0.5, 1.1, kNan}) {
    EXPECT_THAT(Refusal([&](Problem& p) { p.expansion.hyperbolic_exponent = bad; }),
                StartsWith("expansion.hyperbolic_exponent: "));
  }
  EXPECT_EQ(Refusal([](Problem& p) { p.expansion.order = 0; }),
            "expansion.order: 0 must be at least 1");
  for (const double bad : {0.5, kNan, kInfinity}) {
    EXPECT_THAT(Refusal([&](Problem& p) { p.expansion.points_per_term = bad; }),
                AllOf(StartsWith("expansion.points_per_term: "), HasSubstr("must be at least 1")));
  }
}

TEST(ResolvedProblem, NeedsMorePointsThanTermsToAdapt) {
  EXPECT_THAT(Refusal([](Problem& p) { p.expansion.points_per_term = 1; }),
              StartsWith("expansion.points_per_term: 1 gives 10 points for 10 terms; an adaptive "
                         "expansion needs more points than terms"));
  Problem fixed = Good();
  fixed.expansion.points_per_term = 1;
  fixed.expansion.adaptive = false;
  EXPECT_TRUE(ResolvedProblem::Make(fixed).ok());
}

// A tensor grid serves the prior alone: the moved expansion has pointsPerTerm points a term.
TEST(ResolvedProblem, NeedsMorePointsThanTermsToAdaptAfterATensorGridToo) {
  EXPECT_THAT(Refusal([](Problem& p) {
                p.expansion.points = PointSet::kGaussTensor;
                p.expansion.points_per_term = 1;
              }),
              StartsWith("expansion.points_per_term: 1 gives 10 points for 10 terms"));
}

TEST(ResolvedProblem, NeedsANoise) {
  EXPECT_EQ(Refusal([](Problem& p) { p.measured[1].noise = {}; }),
            "measured[1].noise: output x needs a noise: at least one of absolute, relative, "
            "relativeToMax must be above 0, or the noise unknown");
}

TEST(ResolvedProblem, RefusesANoiseThatIsNegativeOrNotFinite) {
  EXPECT_EQ(Refusal([](Problem& p) { p.measured[0].noise.absolute = -1; }),
            "measured[0].noise.absolute: -1 must be a finite number ≥ 0");
  EXPECT_EQ(Refusal([](Problem& p) { p.measured[0].noise.relative = kNan; }),
            "measured[0].noise.relative: nan must be a finite number ≥ 0");
  EXPECT_EQ(Refusal([](Problem& p) { p.measured[0].noise.relative_to_max = kInfinity; }),
            "measured[0].noise.relative_to_max: inf must be a finite number ≥ 0");
  EXPECT_EQ(Refusal([](Problem& p) { p.measured[0].noise.full_scale = -1; }),
            "measured[0].noise.full_scale: -1 must be a finite number ≥ 0");
  EXPECT_EQ(Refusal([](Problem& p) { p.measured[0].noise.full_scale = 10; }),
            "measured[0].noise.full_scale: 10 has no effect without relativeToMax, the noise as a "
            "fraction of it");
}

// Squares of outputs in units of the noise would not be finite.
TEST(ResolvedProblem, RefusesANoiseOfNoMagnitude) {
  for (const double bad : {1e-60, 1e60}) {
    EXPECT_THAT(Refusal([&](Problem& p) { p.measured[0].noise.absolute = bad; }),
                AllOf(StartsWith("measured[0].noise.absolute: "),
                      HasSubstr("must be 0 or lie between 1e-50 and 1e+50")));
  }
}

TEST(ResolvedProblem, RefusesValuesThatAreNotFinite) {
  for (const double bad : {kInfinity, -1e101}) {
    EXPECT_THAT(Refusal([&](Problem& p) { p.fixed["c"] = bad; }),
                AllOf(StartsWith("fixed.c: "),
                      HasSubstr("must be finite and at most 1e+100 in magnitude")));
  }
  for (const double bad : {-1.0, kNan, kInfinity}) {
    EXPECT_THAT(Refusal([&](Problem& p) { p.regularization = bad; }),
                AllOf(StartsWith("regularization: "), HasSubstr("must be a finite number ≥ 0")));
  }
  EXPECT_THAT(Refusal([](Problem& p) { p.integration.relative_tolerance = kNan; }),
              HasSubstr("nan"));
}

}  // namespace
}  // namespace polyest::internal::problem_test
