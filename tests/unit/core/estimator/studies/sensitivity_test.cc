#include "core/estimator/studies/sensitivity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/model/equations/equation_model.h"
#include "polyest/catalogue.h"

namespace polyest::internal::sensitivity_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Problem ProblemOf(EquationSpecification equations, std::vector<UncertainParameter> uncertain) {
  Problem problem;
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = std::move(uncertain);
  return problem;
}

ResolvedProblem Resolve(Problem problem) {
  return ResolvedProblem::Make(std::move(problem)).value();
}

SensitivityAnalysis Analyze(const Problem& problem, double until_s = 1, double step_s = 1) {
  SensitivityOptions options;
  options.until_s = until_s;
  options.step_s = step_s;
  const auto result = AnalyzeSensitivity(Resolve(problem), options, {});
  EXPECT_TRUE(result.ok()) << result.status();
  return *result;
}

UncertainParameter Uniform(const char* name, double lower, double upper) {
  return UncertainParameter::Uniform(name, lower, upper).value();
}

UncertainParameter Normal(const char* name, double mean, double std_dev) {
  return UncertainParameter::Normal(name, mean, std_dev).value();
}

// Makes x = x0 + a t with x0 ~ N(0, 2²), a ~ N(1, 3²), and x measured with σ = 0.5.
Problem Line() {
  Problem problem = ProblemOf({.states = {{"x", "a"}}, .outputs = {{"x", "x"}}},
                              {Normal("x_0", 0, 2), Normal("a", 1, 3)});
  problem.measured = {{"x", {.absolute = 0.5}}};
  return problem;
}

TEST(Sensitivity, HasTheClosedFormOfAPolynomialOfUniformParameters) {
  // The output for a = ½ + u and b = ½ + v is y = a + 2 b + a b = const + 3/2 u + 5/2 v + u v. The
  // variance of u and v is 1/12, so that V = (27 + 75 + 1)/144. Order 3 represents it exactly.
  const SensitivityAnalysis result = Analyze(
      ProblemOf({.outputs = {{"y", "a + 2*b + a*b"}}}, {Uniform("a", 0, 1), Uniform("b", 0, 1)}));
  ASSERT_EQ(result.outputs.size(), 1u);
  EXPECT_THAT(result.parameters, ElementsAre("a", "b"));
  const OutputSensitivity& y = result.outputs[0];
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(y.std_dev[k], std::sqrt(103.0) / 12, 1e-12);
    EXPECT_NEAR(y.first_order(k, 0), 27.0 / 103, 1e-12);
    EXPECT_NEAR(y.first_order(k, 1), 75.0 / 103, 1e-12);
    EXPECT_NEAR(y.total(k, 0), 28.0 / 103, 1e-12);
    EXPECT_NEAR(y.total(k, 1), 76.0 / 103, 1e-12);
    EXPECT_NEAR(y.residual[k], 0, 1e-12);
  }
  ASSERT_EQ(result.activity.size(), 2u);
  EXPECT_EQ(result.activity[0].parameter, "b");
  EXPECT_NEAR(result.activity[0].share, 76.0 / 103, 1e-12);
  EXPECT_NEAR(result.activity[1].share, 28.0 / 103, 1e-12);
  EXPECT_THAT(result.diagnostics, IsEmpty());
}

TEST(Sensitivity, HasTheClosedFormOfAProductOfNormalAndGammaParameters) {
  // The variance is V = μ_b² σ_a² + μ_a² σ_b² + σ_a² σ_b² with a ~ N(2, 1), b ~ Gamma(4, 0.5): μ_b
  // = 2, σ_b = 1.
  const SensitivityAnalysis result =
      Analyze(ProblemOf({.outputs = {{"y", "a*b"}}},
                        {Normal("a", 2, 1), UncertainParameter::Gamma("b", 4, 0.5, 0).value()}));
  const OutputSensitivity& y = result.outputs[0];
  EXPECT_NEAR(y.std_dev[0], 3, 1e-9);
  EXPECT_NEAR(y.first_order(0, 0), 4.0 / 9, 1e-9);
  EXPECT_NEAR(y.first_order(0, 1), 4.0 / 9, 1e-9);
  EXPECT_NEAR(y.total(0, 0), 5.0 / 9, 1e-9);
  EXPECT_NEAR(y.total(0, 1), 5.0 / 9, 1e-9);
}

TEST(Sensitivity, OfAPureInteractionIsAllTotalAndNothingAlone) {
  const SensitivityAnalysis result =
      Analyze(ProblemOf({.outputs = {{"y", "a*b*c"}}},
                        {Uniform("a", -1, 1), Uniform("b", -1, 1), Uniform("c", -1, 1)}));
  const OutputSensitivity& y = result.outputs[0];
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(y.first_order(0, i), 0, 1e-12);
    EXPECT_NEAR(y.total(0, i), 1, 1e-12);
    EXPECT_NEAR(result.activity[static_cast<size_t>(i)].share, 1, 1e-12);
  }
}

TEST(Sensitivity, ChangesOverTime) {
  // The variance is V = 4 + 9 t².
  const SensitivityAnalysis result = Analyze(Line(), 2, 0.5);
  EXPECT_THAT(result.time_s, ElementsAre(0, 0.5, 1, 1.5, 2));
  const OutputSensitivity& x = result.outputs[0];
  for (int k = 0; k < 5; ++k) {
    const double t = result.time_s[static_cast<size_t>(k)];
    EXPECT_NEAR(x.first_order(k, 0), 4 / (4 + 9 * t * t), 1e-9);
    EXPECT_NEAR(x.first_order(k, 1), 9 * t * t / (4 + 9 * t * t), 1e-9);
    EXPECT_NEAR(x.total(k, 1), x.first_order(k, 1), 1e-9);
    EXPECT_EQ(x.noise[k], 0.5);
  }
}

TEST(Activity, IsTheShareOfTheVarianceOverTime) {
  // The integrals are ∫ 4 dt = 8 and ∫ 9 t² dt = 24 over 2 s. The trapezoidal rule errs by h²/12 ·
  // 2 · 9 · 2 at h = 0.01.
  const SensitivityAnalysis result = Analyze(Line(), 2, 0.01);
  ASSERT_EQ(result.activity.size(), 2u);
  EXPECT_EQ(result.activity[0].parameter, "a");
  EXPECT_NEAR(result.activity[0].share, 0.75, 1e-4);
  EXPECT_NEAR(result.activity[1].share, 0.25, 1e-4);
  // The peaks are σ_a t/σ = 3 · 2/0.5 at the end and σ_x0/σ = 2/0.5.
  EXPECT_NEAR(result.activity[0].peak_to_noise, 12, 1e-6);
  EXPECT_NEAR(result.activity[1].peak_to_noise, 4, 1e-6);
}

TEST(Activity, WeighsOutputsByTheirNoise) {
  // The output p = 2 a is measured four times as exactly, in its own unit, as q = 1000 b. The
  // shares are as (2/1)² to (1000/2000)².
  Problem problem = ProblemOf({.outputs = {{"p", "2*a"}, {"q", "1000*b"}}},
                              {Normal("a", 0, 1), Normal("b", 0, 1)});
  problem.measured = {{"p", {.absolute = 1}}, {"q", {.absolute = 2000}}};
  const SensitivityAnalysis result = Analyze(problem);
  EXPECT_NEAR(result.activity[0].share, 4 / 4.25, 1e-12);
  EXPECT_NEAR(result.activity[1].share, 0.25 / 4.25, 1e-12);
}

TEST(Activity, DoesNotDependOnTheUnitsOfOutputsThatAreNotMeasured) {
  const auto shares = [](const char* p, const char* q) {
    const SensitivityAnalysis result = Analyze(
        ProblemOf({.outputs = {{"p", p}, {"q", q}}}, {Normal("a", 1, 1), Normal("b", 1, 0.3)}));
    // The noise is 1 % of the range mean ± 2 standard deviations.
    EXPECT_NEAR(result.outputs[0].noise[0], 0.04 * result.outputs[0].std_dev[0], 1e-12);
    return std::vector<double>{result.activity[0].share, result.activity[1].share};
  };
  const std::vector<double> in_one_unit = shares("a*b", "a + b");
  const std::vector<double> in_another = shares("1000*a*b", "a + b");
  EXPECT_NEAR(in_one_unit[0], in_another[0], 1e-9);
  EXPECT_NEAR(in_one_unit[1], in_another[1], 1e-9);
}

TEST(Sensitivity, IsZeroWhereAnOutputDoesNotVary) {
  const Problem problem = ProblemOf({.states = {{"x", "a"}},
                                     .outputs = {{"x", "x"}, {"c", "3"}},
                                     .parameters = {{"x_0", 2}, {"unused", 0}}},
                                    {Normal("a", 1, 0.1), Normal("unused", 0, 1)});
  const SensitivityAnalysis result = Analyze(problem, 1, 0.5);
  const OutputSensitivity& c = result.outputs[0];
  const OutputSensitivity& x = result.outputs[1];
  EXPECT_EQ(c.output, "c");
  EXPECT_TRUE((c.total.array() == 0).all());
  EXPECT_TRUE((c.first_order.array() == 0).all());
  EXPECT_TRUE((x.total.row(0).array() == 0).all());
  EXPECT_NEAR(x.total(1, 0), 1, 1e-9);
  EXPECT_NEAR(x.total(1, 1), 0, 1e-9);
  EXPECT_EQ(result.activity[1].parameter, "unused");
  EXPECT_NEAR(result.activity[1].share, 0, 1e-9);
  EXPECT_THAT(result.diagnostics, IsEmpty());
}

Problem Oscillator() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"x0", 1}};
  problem.uncertain = {Uniform("k", 31.584, 47.376), Uniform("c", 0.1, 0.3)};
  problem.measured = {{"x", {.absolute = 0.01}}};
  return problem;
}

TEST(Sensitivity, SaysWhereTheExpansionCannotBeBelieved) {
  EXPECT_THAT(Analyze(Oscillator(), 1, 0.05).diagnostics, IsEmpty());
  const SensitivityAnalysis long_record = Analyze(Oscillator(), 20, 0.05);
  ASSERT_EQ(long_record.diagnostics.size(), 1u);
  EXPECT_EQ(long_record.diagnostics[0].code, DiagnosticCode::kExpansionInaccurate);
  EXPECT_THAT(long_record.diagnostics[0].message, AllOf(HasSubstr("of x"), HasSubstr("at t = ")));
  Problem finer = Oscillator();
  finer.expansion.order = 16;
  EXPECT_THAT(Analyze(finer, 5, 0.05).diagnostics, IsEmpty());
}

TEST(Sensitivity, SaysWhereAnExpansionWithoutPointsToSpareCannotBeBelieved) {
  Problem problem = Oscillator();
  problem.expansion.adaptive = false;
  problem.expansion.points_per_term = 1;
  // It passes through its points, but not through the model elsewhere.
  const SensitivityAnalysis result = Analyze(problem, 20, 0.05);
  EXPECT_GT(result.outputs[0].residual.maxCoeff(), 0.1);
  ASSERT_EQ(result.diagnostics.size(), 1u);
  EXPECT_EQ(result.diagnostics[0].code, DiagnosticCode::kExpansionInaccurate);
}

// A stiffening spring under a force that turns. Where its cubic stiffness is in the long tail of
// the prior, the expansion leaves the model by several standard deviations, although it follows the
// model at its own points. 4000 pairs of draws (pick-freeze) give the total shares 0.77 of k and
// 0.54 of k3.
TEST(Sensitivity, SaysThatAnExpansionLeavesTheModelInTheTailOfThePrior) {
  Problem problem =
      ProblemOf({.states = {{"x", "v"}, {"v", "u - 0.5*v - k*x - k3*x^3"}},
                 .outputs = {{"x", "x"}},
                 .inputs = {"u"}},
                {Uniform("k", 5, 30), UncertainParameter::Lognormal("k3", 30, 60).value()});
  problem.inputs = {{"u", TableInput{{0, 1.8, 3, 4.8, 100}, {8, 8, -4, 8, 8}}}};
  problem.measured = {{"x", {.absolute = 0.05}}};
  for (const int order : {3, 9}) {
    problem.expansion.order = order;
    const SensitivityAnalysis result = Analyze(problem, 6, 0.06);
    ASSERT_EQ(result.diagnostics.size(), 1u);
    EXPECT_EQ(result.diagnostics[0].code, DiagnosticCode::kExpansionInaccurate);
  }
}

TEST(Sensitivity, SaysThatTrajectoriesFailed) {
  // The output x becomes infinite soon after 0.5 s where a passes 1.8.
  const Problem problem = ProblemOf(
      {.states = {{"x", "a + if(a > 1.8 && t > 0.5, 1e4*x^2, 0)"}}, .outputs = {{"x", "x"}}},
      {Uniform("a", 1, 2)});
  const SensitivityAnalysis result = Analyze(problem, 1, 0.25);
  ASSERT_EQ(result.diagnostics.size(), 1u);
  EXPECT_EQ(result.diagnostics[0].code, DiagnosticCode::kPointsFailed);
  EXPECT_NEAR(result.outputs[0].total(4, 0), 1, 1e-9);
}

TEST(Sensitivity, SaysThatAnOutputIsTooLarge) {
  SensitivityOptions options;
  options.until_s = options.step_s = 1;
  const auto status = AnalyzeSensitivity(
      Resolve(ProblemOf({.outputs = {{"y", "1e200*a"}}}, {Uniform("a", 1, 2)})), options, {});
  EXPECT_EQ(status.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.status().message()),
              HasSubstr("an output exceeds 1e100 in magnitude"));
}

TEST(Sensitivity, RefusesCorrelatedParameters) {
  Problem problem = Line();
  problem.correlations = {{"x_0", "a", 0.5}};
  SensitivityOptions options;
  options.until_s = options.step_s = 1;
  const absl::Status status = AnalyzeSensitivity(Resolve(problem), options, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("correlations: "), HasSubstr("x_0 and a")));
}

TEST(Sensitivity, RefusalNamesFieldValueAndRule) {
  const ResolvedProblem problem = Resolve(Line());
  const auto refusal = [&](auto change) {
    SensitivityOptions options;
    options.until_s = 2;
    options.step_s = 1;
    change(options);
    return std::string(AnalyzeSensitivity(problem, options, {}).status().message());
  };
  EXPECT_THAT(refusal([](auto& o) { o.until_s = -1; }), HasSubstr("until_s: -1 must be"));
  EXPECT_THAT(refusal([](auto& o) { o.step_s = 3; }),
              HasSubstr("step_s: 3 must be at most until 2"));
  EXPECT_THAT(refusal([](auto& o) { o.outputs = {"y"}; }), HasSubstr("outputs[0]"));
  EXPECT_THAT(refusal([](auto& o) { o.threads = 0; }), HasSubstr("threads: 0"));
  EXPECT_THAT(refusal([](auto& o) { o.draws = -1; }), HasSubstr("draws: -1"));
  EXPECT_THAT(refusal([](auto& o) { o.step_s = 1e-9; }), HasSubstr("limit"));
}

TEST(Sensitivity, DoesNotDependOnTheNumberOfThreads) {
  SensitivityOptions options;
  options.until_s = 2;
  options.step_s = 0.1;
  const SensitivityAnalysis one = AnalyzeSensitivity(Resolve(Oscillator()), options, {}).value();
  options.threads = 3;
  const SensitivityAnalysis three = AnalyzeSensitivity(Resolve(Oscillator()), options, {}).value();
  EXPECT_EQ(one.outputs[0].total, three.outputs[0].total);
}

}  // namespace
}  // namespace polyest::internal::sensitivity_test
