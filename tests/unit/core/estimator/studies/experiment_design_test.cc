#include "core/estimator/studies/experiment_design.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "core/estimator/estimator_access.h"
#include "core/estimator/studies/information_gain.h"
#include "core/estimator/studies/sample_times.h"
#include "core/model/equations/equation_model.h"
#include "polyest/catalogue.h"
#include "polyest/estimator.h"
#include "tests/unit/core/estimator/studies/line_experiment.h"

namespace polyest::internal::line_experiment {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

ExperimentDesign Design(const Problem& problem, double until_s, double step_s, int samples = 3,
                        std::vector<MeasuredOutput> possible = {}) {
  ExperimentOptions options;
  options.until_s = until_s;
  options.step_s = step_s;
  options.samples = samples;
  options.possible = std::move(possible);
  const auto design = DesignExperiment(Resolve(problem), options, {});
  EXPECT_TRUE(design.ok()) << design.status();
  return *design;
}

TEST(ExperimentDesign, OfALinearModelIsKalmansUpdate) {
  // The slopes are the same everywhere, so that the mean over draws is exact.
  const ExperimentDesign design = Design(Line(), 2, 0.5);
  const Eigen::Matrix2d after = LineCovariance({0, 0.5, 1, 1.5, 2});
  EXPECT_NEAR(design.gain.bits, LineBits(after), 1e-7);
  EXPECT_NEAR(design.gain.std_dev[0], std::sqrt(after(0, 0)), 1e-7);
  EXPECT_NEAR(design.gain.std_dev[1], std::sqrt(after(1, 1)), 1e-7);
  EXPECT_THAT(design.diagnostics, IsEmpty());
}

TEST(ExperimentDesign, TakesTheBestTimesOneAfterTheOther) {
  // The last time tells most about x_0 + a t, and beside it the first tells most about x_0. The
  // last but one comes next, by the determinants of all choices below.
  const ExperimentDesign design = Design(Line(), 2, 0.5, 3);
  ASSERT_EQ(design.samples.size(), 3u);
  std::vector<double> chosen;
  for (int step = 0; step < 3; ++step) {
    double best = 0;
    double best_bits = 0;
    for (const double t : {0.0, 0.5, 1.0, 1.5, 2.0}) {
      if (std::count(chosen.begin(), chosen.end(), t) > 0) continue;
      std::vector<double> times = chosen;
      times.push_back(t);
      const double bits = LineBits(LineCovariance(times));
      if (bits > best_bits) {
        best_bits = bits;
        best = t;
      }
    }
    chosen.push_back(best);
    const SampleTime& sample = design.samples[static_cast<size_t>(step)];
    EXPECT_EQ(sample.time_s, best);
    EXPECT_NEAR(sample.gain.bits, best_bits, 1e-7);
    EXPECT_NEAR(sample.gain.std_dev[1], std::sqrt(LineCovariance(chosen)(1, 1)), 1e-7);
  }
  EXPECT_THAT(chosen, ElementsAre(2, 0, 1.5));
}

TEST(ExperimentDesign, ComparesOutputsAloneAndTogether) {
  // The output v = a with σ = 0.1 at five times tells a alone: its precision is 1/9 + 5/0.01.
  const ExperimentDesign design = Design(Line(), 2, 0.5, 3, {{"v", {.absolute = 0.1}}});
  ASSERT_EQ(design.outputs.size(), 2u);
  const OutputGain& x = design.outputs[0];
  EXPECT_EQ(x.output, "x");
  EXPECT_TRUE(x.measured);
  EXPECT_NEAR(x.noise, 0.5, 1e-12);
  EXPECT_EQ(x.alone.bits, design.gain.bits);
  EXPECT_EQ(x.together.bits, design.gain.bits);
  const OutputGain& v = design.outputs[1];
  EXPECT_EQ(v.output, "v");
  EXPECT_FALSE(v.measured);
  EXPECT_NEAR(v.noise, 0.1, 1e-12);
  EXPECT_NEAR(v.alone.bits, 0.5 * std::log2(9 * (1.0 / 9 + 500)), 1e-7);
  EXPECT_NEAR(v.alone.std_dev[0], 2, 1e-7);
  EXPECT_NEAR(v.alone.std_dev[1], 1 / std::sqrt(1.0 / 9 + 500), 1e-9);
  Eigen::Matrix2d precision = LineCovariance({0, 0.5, 1, 1.5, 2}).inverse();
  precision(1, 1) += 500;
  EXPECT_NEAR(v.together.bits, LineBits(precision.inverse()), 1e-7);
}

TEST(ExperimentDesign, AssumesOnePercentOfTheRangeForNoiseThatIsNotKnown) {
  // The range of v = a is four standard deviations of 64 draws of it, 12 but for their scatter.
  const ExperimentDesign design = Design(Line(), 2, 0.5);
  ASSERT_EQ(design.outputs.size(), 2u);
  const ResolvedProblem problem = Resolve(Line());
  const Vector a =
      problem.prior().Mean()[1] + 3 * DrawTruths(problem.prior(), design.draws).col(1).array();
  const double deviation = std::sqrt((a.array() - a.mean()).square().mean());
  EXPECT_NEAR(design.outputs[1].noise, 0.01 * 4 * deviation, 1e-9);
  EXPECT_NEAR(deviation, 3, 0.3);
}

TEST(ExperimentDesign, TakesAnOutputThatIsMeasuredAnywayOnce) {
  EXPECT_EQ(Design(Line(), 2, 0.5, 1, {{"x", {}}, {"v", {}}, {"v", {}}}).outputs.size(), 2u);
  EXPECT_EQ(Design(Line(), 2, 0.5, 1, {{"x", {}}}).outputs.size(), 1u);
}

TEST(ExperimentDesign, PlansAllOutputsWhenNoneIsMeasured) {
  Problem problem = Line();
  problem.measured.clear();
  const ExperimentDesign design = Design(problem, 2, 0.5, 1);
  ASSERT_EQ(design.outputs.size(), 2u);
  EXPECT_FALSE(design.outputs[0].measured);
  EXPECT_GT(design.gain.bits, design.outputs[0].alone.bits);
  EXPECT_GT(design.gain.bits, design.outputs[1].alone.bits);
  EXPECT_EQ(design.outputs[0].together.bits, design.gain.bits);
}

TEST(ExperimentDesign, AveragesOverThePriorWhereTheModelIsNotLinear) {
  // The gain for y = a², a ~ N(1, 0.2²), σ = 0.1 is the mean of ½ log₂(1 + (2 a · 0.2/0.1)²). The
  // oracle is midpoint quadrature; 64 draws of Halton's sequence err by about a hundredth.
  Problem problem = ProblemOf({.outputs = {{"y", "a^2"}}}, {Normal("a", 1, 0.2)});
  problem.measured = {{"y", {.absolute = 0.1}}};
  const ExperimentDesign design = Design(problem, 1, 1, 1);
  double mean = 0;
  for (double u = -6; u < 6; u += 1e-3) {
    const double density = std::exp(-0.5 * u * u) / std::sqrt(2 * std::numbers::pi);
    const double slope = 2 * (1 + 0.2 * u) * 0.2 / 0.1;
    mean += 1e-3 * density * 0.5 * std::log2(1 + slope * slope);
  }
  ASSERT_EQ(design.samples.size(), 1u);
  EXPECT_NEAR(design.samples[0].gain.bits, mean, 0.03);
}

TEST(ExperimentDesign, KeepsThePriorOfWhatIsNotSeen) {
  Problem problem =
      ProblemOf({.outputs = {{"y", "a"}}, .parameters = {{"b", 1}}},
                {Normal("a", 0, 1), UncertainParameter::Lognormal("b", 3, 2).value()});
  problem.measured = {{"y", {.absolute = 0.1}}};
  const ExperimentDesign design = Design(problem, 1, 1, 5);
  EXPECT_NEAR(design.gain.std_dev[1], 2, 1e-6);
  EXPECT_EQ(design.samples.size(), 2u);
}

TEST(ExperimentDesign, ChoosesNoTimesThatAddNothing) {
  Problem problem =
      ProblemOf({.states = {{"x", "a"}}, .outputs = {{"x", "x"}}}, {Normal("a", 1, 1)});
  problem.measured = {{"x", {.absolute = 0.1}}};
  const ExperimentDesign design = Design(problem, 1, 0.5, 10);
  ASSERT_EQ(design.samples.size(), 2u);  // t = 0 is not among them.
  EXPECT_EQ(design.samples[0].time_s, 1);
  EXPECT_EQ(design.samples[1].time_s, 0.5);
}

TEST(ExperimentDesign, PrefersAnInputThatExcites) {
  const auto bits = [](InputSpecification signal) {
    Problem problem;
    problem.model = *FindBuiltinModel("mass_spring_damper");
    problem.fixed = {{"m", 1}, {"c", 1}};
    problem.uncertain = {UncertainParameter::Uniform("k", 36, 42).value()};
    problem.inputs = {{"force", std::move(signal)}};
    problem.measured = {{"x", {.absolute = 0.001}}};
    return Design(problem, 5, 0.05).gain.bits;
  };
  const double resonant = bits(SinusoidInput{.amplitude = 1, .frequency_hz = 1});
  const double slow = bits(SinusoidInput{.amplitude = 1, .frequency_hz = 0.1});
  const double none = bits(ConstantInput{0});
  EXPECT_GT(resonant, slow + 1);
  EXPECT_GT(slow, 1);
  EXPECT_NEAR(none, 0, 1e-9);
}

// A free vibration without damping, x = cos √(k/m) t.
Problem FreeVibration(std::vector<UncertainParameter> uncertain) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"x0", 1}, {"c", 0}};
  problem.uncertain = std::move(uncertain);
  problem.measured = {{"x", {.absolute = 0.01}}};
  return problem;
}

// Over ten periods no expansion of low order follows the model. The slope of x by k is
// −t sin(√k t)/(2 √k); the oracle is midpoint quadrature over k.
TEST(ExperimentDesign, FollowsTheModelOverALongTime) {
  constexpr double kLower = 31.584, kUpper = 47.376;
  Problem problem = FreeVibration({UncertainParameter::Uniform("k", kLower, kUpper).value()});
  problem.fixed["m"] = 1;
  const ExperimentDesign design = Design(problem, 10, 0.05);
  const double deviation = (kUpper - kLower) / std::sqrt(12);
  constexpr int kPoints = 1000;
  double mean = 0;
  for (int i = 0; i < kPoints; ++i) {
    const double omega = std::sqrt(kLower + (kUpper - kLower) * (i + 0.5) / kPoints);
    double information = 0;
    for (int row = 0; row <= 200; ++row) {
      const double t = 0.05 * row;
      const double slope = t * std::sin(omega * t) / (2 * omega) * deviation / 0.01;
      information += slope * slope;
    }
    mean += 0.5 * std::log2(1 + information) / kPoints;
  }
  EXPECT_NEAR(design.gain.bits, mean, 0.03);
  EXPECT_THAT(design.diagnostics, IsEmpty());
  EXPECT_EQ(design.draws, 64);
  EXPECT_EQ(design.trajectories, 64 * 3);
}

// Only k/m shows in a free vibration: the standard deviation of both, a tenth, falls by √2.
TEST(ExperimentDesign, TellsNoParametersApartThatTheModelCannot) {
  const ExperimentDesign design =
      Design(FreeVibration({Normal("m", 1, 0.1), Normal("k", 40, 4)}), 20, 0.1);
  EXPECT_NEAR(design.gain.std_dev[0], 0.1 / std::sqrt(2), 0.05 * 0.1);
  EXPECT_NEAR(design.gain.std_dev[1], 4 / std::sqrt(2), 0.05 * 4);
}

// A trajectory that leaves for infinity before the end takes its draw along.
TEST(ExperimentDesign, LeavesOutDrawsThatCannotBeIntegrated) {
  Problem problem =
      ProblemOf({.states = {{"x", "a*x^2"}}, .outputs = {{"x", "x"}}, .parameters = {{"x_0", 1}}},
                {UncertainParameter::Uniform("a", 0, 1).value()});
  problem.measured = {{"x", {.absolute = 0.1}}};
  const ExperimentDesign design = Design(problem, 2, 0.5);  // a x_0 t reaches 1 for half of them
  EXPECT_NEAR(design.draws, 32, 2);
  ASSERT_EQ(design.diagnostics.size(), 1u);
  EXPECT_EQ(design.diagnostics[0].code, DiagnosticCode::kPointsFailed);
  EXPECT_TRUE(std::isfinite(design.gain.bits));
}

TEST(ExperimentDesign, RefusalNamesFieldValueAndRule) {
  const auto refusal = [](auto change) {
    ExperimentOptions options;
    options.until_s = 2;
    options.step_s = 0.5;
    change(options);
    return std::string(DesignExperiment(Resolve(Line()), options, {}).status().message());
  };
  EXPECT_THAT(refusal([](auto& o) { o.until_s = 0; }), HasSubstr("until_s: 0 must"));
  EXPECT_THAT(refusal([](auto& o) { o.samples = 0; }), HasSubstr("samples: 0 must"));
  EXPECT_THAT(refusal([](auto& o) { o.samples = 1001; }), HasSubstr("1 to 1000"));
  EXPECT_THAT(refusal([](auto& o) {
                o.possible = {{"w", {}}};
              }),
              AllOf(HasSubstr("possible[0]"), HasSubstr("\"w\""), HasSubstr("v, x")));
  EXPECT_THAT(refusal([](auto& o) {
                o.possible = {{"x", {.absolute = 1}}};
              }),
              HasSubstr("possible[0].noise: output x has a noise already"));
  EXPECT_THAT(refusal([](auto& o) {
                o.possible = {{"v", {.absolute = -1}}};
              }),
              HasSubstr("possible[0].noise.absolute: -1"));
  EXPECT_THAT(refusal([](auto& o) { o.step_s = 1e-6; }), HasSubstr("limit"));
}

TEST(ExperimentDesign, EndsOnAStopRequest) {
  std::stop_source source;
  source.request_stop();
  const Stop stop(source.get_token());
  ExperimentOptions options;
  options.until_s = 2;
  options.step_s = 0.5;
  EXPECT_EQ(DesignExperiment(Resolve(Line()), options, stop).status().code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(ChooseSampleTimes({Matrix::Ones(2, 1)}, 1, 1, stop).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace polyest::internal::line_experiment
