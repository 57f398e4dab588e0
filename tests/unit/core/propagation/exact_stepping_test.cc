// Tests the exact steps of linear models. The oracles are closed forms, and the explicit integrator
// at a tight tolerance. Times, states and inputs are of the order of 1, so errors of some hundred
// roundings a sample are below kRounding.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/model/equations/equation_model.h"
#include "core/propagation/linear_system.h"
#include "tests/unit/core/propagation/ensemble.h"
#include "tests/unit/core/propagation/oscillator.h"

namespace polyest::internal {
namespace {

constexpr double kRounding = 1e-12;

Ensemble Of(const std::vector<Oscillator>& oscillators) {
  Ensemble ensemble("mass_spring_damper", static_cast<int>(oscillators.size()), {"x"});
  for (int point = 0; point < ensemble.points(); ++point) {
    const Oscillator& oscillator = oscillators[static_cast<size_t>(point)];
    ensemble.Set("m", point, oscillator.m);
    ensemble.Set("c", point, oscillator.c);
    ensemble.Set("k", point, oscillator.k);
    ensemble.Set("x0", point, oscillator.x0);
    ensemble.Set("v0", point, oscillator.v0);
  }
  return ensemble;
}

std::vector<double> IrregularTimes(int count, double mean_step_s) {
  std::vector<double> times_s;
  double time_s = 0;
  for (int i = 0; i < count; ++i) {
    time_s += mean_step_s * (1 + 0.9 * std::sin(1.7 * i * i));
    times_s.push_back(time_s);
  }
  return times_s;
}

// Underdamped, overdamped, undamped and soft.
const std::vector<Oscillator> kOscillators = {
    {1, 0.2, 40, 1, -2}, {1, 30, 40, 1, 5}, {2, 0, 50, 0, 3}, {1, 0.01, 0.5, -1, 0.3}};

TEST(ExactStepping, FollowsTheClosedFormOfOscillatorsToRoundingErrors) {
  for (const std::vector<double>& times_s :
       {TimesUntil(20, 0.05), TimesUntil(20, 5.0), IrregularTimes(300, 0.07)}) {
    Ensemble ensemble = Of(kOscillators);
    ASSERT_TRUE(StepsExactly(ensemble.specification, ensemble.inputs));
    const Matrix x = ensemble.Propagate(times_s);
    for (int point = 0; point < ensemble.points(); ++point) {
      for (size_t i = 0; i < times_s.size(); ++i) {
        const double exact = kOscillators[static_cast<size_t>(point)].Free(times_s[i]);
        EXPECT_NEAR(x(point, static_cast<Eigen::Index>(i)), exact, kRounding)
            << point << " " << times_s[i];
      }
    }
  }
}

TEST(ExactStepping, LosesNothingOverTwentyThousandPeriods) {
  // At a relative rounding error of 1e-16 a step, all alike, amplitude and phase drift by at most
  // 4e-11 in 4e5 steps; an integrator at 1e-7 loses 3e-3 of the amplitude.
  const Oscillator oscillator{1, 2e-5, 39.478417604357434, 1, 0};
  Ensemble ensemble = Of({oscillator});
  const std::vector<double> times_s = TimesUntil(20000, 0.05);
  const Matrix x = ensemble.Propagate(times_s);
  double worst = 0;
  for (size_t i = 0; i < times_s.size(); ++i) {
    worst =
        std::max(worst, std::abs(x(0, static_cast<Eigen::Index>(i)) - oscillator.Free(times_s[i])));
  }
  EXPECT_LT(worst, 4e-10);
}

TEST(ExactStepping, HandlesMatricesWithoutAFullSetOfEigenvectors) {
  // Critical damping: x = (x0 + (v0 + ω x0) t) e^{−ω t}. No spring and no damper: x = x0 + v0 t.
  Ensemble ensemble = Of({{1, 6, 9, 1, 2}, {3, 0, 0, 1, 2}, {1, 0, 0, 0, 0}});
  const std::vector<double> times_s = IrregularTimes(50, 0.1);
  const Matrix x = ensemble.Propagate(times_s);
  for (Eigen::Index i = 0; i < std::ssize(times_s); ++i) {
    const double t = times_s[static_cast<size_t>(i)];
    EXPECT_NEAR(x(0, i), (1 + 5 * t) * std::exp(-3 * t), kRounding);
    EXPECT_NEAR(x(1, i), 1 + 2 * t, kRounding);
    EXPECT_EQ(x(2, i), 0);
  }
}

TEST(ExactStepping, FollowsStiffSystemsInWhichTheFastModeIsGone) {
  // The fast mode decays in a microsecond. Rounding errors of the slow one grow with h · rate, 5e5.
  const Oscillator stiff{1, 1e6, 1.1e6, 1, 0};
  for (const std::vector<double>& times_s : {TimesUntil(5, 0.5), IrregularTimes(30, 0.2)}) {
    Ensemble ensemble = Of({stiff});
    const Matrix x = ensemble.Propagate(times_s);
    for (size_t i = 0; i < times_s.size(); ++i) {
      EXPECT_NEAR(x(0, static_cast<Eigen::Index>(i)), stiff.Free(times_s[i]), 1e-9);
    }
  }
}

TEST(ExactStepping, FollowsGrowthRelativeToTheState) {
  // x″ = x: x = cosh t.
  Ensemble ensemble = Of({{1, 0, -1, 1, 0}});
  const std::vector<double> times_s = TimesUntil(50, 0.5);
  const Matrix x = ensemble.Propagate(times_s);
  for (size_t i = 0; i < times_s.size(); ++i) {
    EXPECT_NEAR(x(0, static_cast<Eigen::Index>(i)) / std::cosh(times_s[i]), 1, kRounding);
  }
}

TEST(ExactStepping, LeavesOutPointsThatPassAllBoundsAndKeepsTheOthers) {
  Ensemble ensemble = Of({{1, 0, 40, 1, 0}, {1, 0, -100, 1, 0}, {1, 0, -1e6, 1, 0}});
  const std::vector<double> times_s = TimesUntil(40, 1);
  const Matrix x = ensemble.Propagate(times_s);
  ASSERT_EQ(ensemble.failures.size(), 2u);
  EXPECT_EQ(ensemble.failures[0].point, 1);
  // The velocity 10 sinh 10 t passes 1e100 at t = 22.9.
  EXPECT_EQ(ensemble.failures[0].time_s, 22);
  EXPECT_THAT(ensemble.failures[0].reason, ::testing::HasSubstr("1e100"));
  EXPECT_EQ(ensemble.failures[1].time_s, 0);
  EXPECT_TRUE(std::isfinite(x(1, 22)));
  EXPECT_TRUE(std::isnan(x(1, 23)));
  EXPECT_NEAR(x(0, 40), std::cos(std::sqrt(40.0) * 40), kRounding);
}

class ExactlyStreamed : public ::testing::TestWithParam<Interpolation> {
 protected:
  ExactlyStreamed() : ensemble_(Of({{1, 0, 40, 0.1, 0.5}, {2, 0.3, 20, 0, 0}})) {
    for (int i = 0; i <= 60; ++i) {
      time_s_.push_back(0.05 * i + 0.01 * (i % 3));
      value_.push_back(std::sin(1.7 * i) * 20);
    }
    ensemble_.Drive("force", StreamedInput{GetParam(), 1}, 1.0);
    ensemble_.specification.input_offsets = Matrix::Constant(2, 1, 0.0);
  }
  Matrix AllAtOnce() {
    ensemble_.inputs[0].Clear();
    for (size_t i = 0; i < time_s_.size(); ++i) ensemble_.inputs[0].Append(time_s_[i], value_[i]);
    ensemble_.inputs[0].Finish();
    return ensemble_.Propagate(time_s_);
  }

  std::vector<double> time_s_, value_;
  Ensemble ensemble_;
};

TEST_P(ExactlyStreamed, GivesWhatATightIntegrationGives) {
  for (const double delay_s : {0.0, 0.013}) {
    ensemble_.specification.input_delays_s = Matrix::Constant(2, 1, delay_s);
    ensemble_.specification.input_offsets(1, 0) = 0.7;
    ensemble_.specification.integration.method = IntegrationMethod::kAuto;
    ASSERT_TRUE(StepsExactly(ensemble_.specification, ensemble_.inputs));
    const Matrix exact = AllAtOnce();
    ensemble_.specification.integration.method = IntegrationMethod::kExplicit;
    ensemble_.specification.integration.relative_tolerance = 1e-12;
    // A step errs by at most 1e-12 of states of the order of 5, and there are some thousand steps.
    EXPECT_LT((exact - AllAtOnce()).cwiseAbs().maxCoeff(), 2e-9);
    EXPECT_GT(exact.cwiseAbs().maxCoeff(), 0.3);
  }
}

TEST_P(ExactlyStreamed, GivesTheSameBitsKnotByKnot) {
  const Matrix at_once = AllAtOnce();
  ensemble_.inputs[0].Clear();
  EnsemblePropagator propagator(ensemble_.specification, &ensemble_.inputs);
  const auto ahead = static_cast<size_t>(ensemble_.inputs[0].knots_ahead());
  for (size_t i = 0, known = 0; i < time_s_.size(); ++i) {
    for (; known < std::min(i + ahead + 1, time_s_.size()); ++known) {
      ensemble_.inputs[0].Append(time_s_[known], value_[known]);
    }
    if (known == time_s_.size() && !ensemble_.inputs[0].finished()) ensemble_.inputs[0].Finish();
    EXPECT_EQ(ensemble_.Advance(propagator, {time_s_[i]}),
              at_once.col(static_cast<Eigen::Index>(i)));
  }
}

TEST_P(ExactlyStreamed, GivesTheClosedFormThroughItsKnots) {
  if (GetParam() != Interpolation::kHold && GetParam() != Interpolation::kLinear) GTEST_SKIP();
  const Matrix x = AllAtOnce();
  const std::vector<double> exact = Oscillator{1, 0, 40, 0.1, 0.5}.ThroughKnots(
      time_s_, value_, GetParam() == Interpolation::kHold);
  for (size_t i = 0; i < time_s_.size(); ++i) {
    EXPECT_NEAR(x(0, static_cast<Eigen::Index>(i)), exact[i], 10 * kRounding);
  }
}

INSTANTIATE_TEST_SUITE_P(AllCurves, ExactlyStreamed,
                         ::testing::Values(Interpolation::kHold, Interpolation::kLinear,
                                           Interpolation::kCubic, Interpolation::kShapePreserving));

TEST(ExactStepping, FollowsEveryClosedFormInputButTheChirp) {
  const std::vector<double> times_s = TimesUntil(4, 0.13);
  for (const InputSpecification& input : std::vector<InputSpecification>{
           ConstantInput{1}, StepInput{1, 0.77}, SinusoidInput{1, 0.9, 0.3},
           HalfSineBumpInput{1, 0.5, 0.2}, TableInput{{0.5, 1.7, 2}, {1, -2, 3}}}) {
    Ensemble ensemble = Of(kOscillators);
    ensemble.Drive("force", input, 3);
    ASSERT_TRUE(StepsExactly(ensemble.specification, ensemble.inputs));
    const Matrix exact = ensemble.Propagate(times_s);
    ensemble.specification.integration.method = IntegrationMethod::kExplicit;
    ensemble.specification.integration.relative_tolerance = 1e-12;
    EXPECT_LT((exact - ensemble.Propagate(times_s)).cwiseAbs().maxCoeff(), 1e-9) << input.index();
  }
}

TEST(ExactStepping, IsNotDoneWhereItWouldNotBeExact) {
  const auto exact = [](const Ensemble& ensemble) {
    return StepsExactly(ensemble.specification, ensemble.inputs);
  };
  Ensemble ensemble = Of(kOscillators);
  EXPECT_TRUE(exact(ensemble));
  ensemble.Drive("force", SinusoidInput{}, 1);
  ensemble.specification.input_delays_s = Matrix::Constant(4, 1, 0.1);
  EXPECT_TRUE(exact(ensemble));
  ensemble.specification.input_delays_s(2, 0) = 0.2;
  EXPECT_FALSE(exact(ensemble));
  ensemble.Drive("force", ConstantInput{}, 1);
  EXPECT_TRUE(exact(ensemble));
  ensemble.Drive("force", ChirpInput{}, 1);
  ensemble.specification.input_delays_s.resize(0, 0);
  EXPECT_FALSE(exact(ensemble));
  ensemble.Drive("force", ConstantInput{}, 1);
  ensemble.Set("m", 1, 0.0);
  EXPECT_FALSE(exact(ensemble));
  ensemble.Set("m", 1, 1.0);
  ensemble.specification.integration.method = IntegrationMethod::kStiff;
  EXPECT_FALSE(exact(ensemble));
  Ensemble duffing("duffing", 3, {"x"});
  EXPECT_FALSE(exact(duffing));
  duffing.Set("k3", 0);
  EXPECT_TRUE(exact(duffing));
  duffing.Set("k2", 1, 1e-9);
  EXPECT_FALSE(exact(duffing));
}

TEST(ExactStepping, GivesTheSameBitsForAnyNumberOfThreadsAndAnyCut) {
  Ensemble ensemble("mass_spring_damper", 150, {"x", "a"});
  for (int point = 0; point < 150; ++point) ensemble.Set("k", point, 3 + 0.1 * point);
  ensemble.Drive("force", SinusoidInput{}, 1);
  std::vector<double> times_s = IrregularTimes(40, 0.2);
  for (const double time_s : TimesUntil(3, 0.1)) times_s.push_back(times_s[39] + time_s);
  const Matrix alone = ensemble.Propagate(times_s);
  ensemble.specification.threads = 3;
  EXPECT_EQ(ensemble.Propagate(times_s), alone);
  EnsemblePropagator propagator(ensemble.specification, &ensemble.inputs);
  for (size_t i = 0; i < times_s.size(); ++i) {
    EXPECT_EQ(ensemble.Advance(propagator, {times_s[i]}),
              alone.middleCols(static_cast<Eigen::Index>(2 * i), 2));
  }
}

TEST(ExactStepping, AgreesWithIntegrationForASystemOfManyStatesFromText) {
  // A chain of masses on a moving base, with an output that is not linear.
  EquationSpecification chain{.outputs = {{"y", "x5^2 + base*x0"}}, .inputs = {"base"}};
  for (int i = 0; i < 6; ++i) {
    const std::string x = "x" + std::to_string(i), v = "v" + std::to_string(i);
    const std::string before = i == 0 ? "base" : "x" + std::to_string(i - 1);
    chain.states[x] = v;
    chain.states[v] = "k*(" + before + " - " + x + ") - c*" + v + " - k3*" + x + "^3 + g";
  }
  const auto model = MakeEquationModel(chain);
  ASSERT_TRUE(model.ok()) << model.status();
  EnsembleSpecification specification;
  specification.model = *model;
  const ModelDescription& description = (*model)->description();
  specification.parameters.setZero(5, std::ssize(description.parameters));
  for (int point = 0; point < 5; ++point) {
    specification.parameters(point, *description.FindParameter("k")) = 20 + point;
    specification.parameters(point, *description.FindParameter("c")) = 0.1 * point;
    specification.parameters(point, *description.FindParameter("g")) = -1;
  }
  specification.amplitudes = Matrix::Ones(5, 1);
  specification.outputs = {0};
  const InputSignals inputs = {
      Signal(TableInput{{0, 0.4, 1, 1.1, 2.5}, {0, 1, -1, 0.5, 0}, Interpolation::kLinear})};
  const std::vector<double> times_s = IrregularTimes(60, 0.05);
  const auto propagate = [&] {
    EnsemblePropagator propagator(specification, &inputs);
    Matrix outputs(5, std::ssize(times_s));
    EXPECT_TRUE(propagator.Advance(times_s, outputs, Stop()).ok());
    return outputs;
  };
  ASSERT_TRUE(StepsExactly(specification, inputs));
  const Matrix exact = propagate();
  specification.integration.method = IntegrationMethod::kExplicit;
  specification.integration.relative_tolerance = 1e-12;
  const double largest = exact.cwiseAbs().maxCoeff();
  // A step errs by up to 1e-12 of each state, there are some thousand steps, and squares double it.
  EXPECT_LT((exact - propagate()).cwiseAbs().maxCoeff(), 5e-9 * largest);
  EXPECT_GT(largest, 0.1);
}

TEST(ExactStepping, KeepsTheAccuracyOfSamplesLateInTime) {
  // Samples of 1 kHz at t = 1e6 s have intervals that differ by their roundings, 1e-10 s.
  const double late_s = 1e6;
  const Oscillator oscillator{1, 0, 40, 1, 0};
  Ensemble ensemble = Of({oscillator});
  std::vector<double> times_s;
  for (int i = 0; i < 3000; ++i) times_s.push_back(late_s + 0.001 * i);
  const Matrix x = ensemble.Propagate(times_s);
  const double w = std::sqrt(oscillator.k);
  // The phase at the first sample is known to 1e6 ω roundings only, so the fit starts there.
  const double x0 = x(0, 0), x1 = x(0, 1), tau1 = times_s[1] - times_s[0];
  const double v0 = (x1 - x0 * std::cos(w * tau1)) * w / std::sin(w * tau1);
  const double tau = times_s[2999] - times_s[0];
  // v0 comes from a difference of neighbours: it has a rounding error of 1e-16/tau1 = 1e-13.
  EXPECT_NEAR(x(0, 2999), x0 * std::cos(w * tau) + v0 / w * std::sin(w * tau), 1e-11);
}

}  // namespace
}  // namespace polyest::internal
