// Tests inputs with a gain, a delay and an offset of each point's own, and outputs with a gain and
// an offset. The oracle is the undamped oscillator of mass m = 1 and stiffness k = ω², at rest
// until a force F jumps on at t₀: x(t) = F/k (1 − cos ω(t − t₀)).

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/propagation/ensemble.h"

namespace polyest::internal {
namespace {

constexpr double kOmega = 3;
// The relative tolerance of the integrator is 1e-7 a step, and there are some hundred steps.
constexpr double kTolerance = 2e-5;

double StepResponse(double force, double since_s) {
  return since_s <= 0 ? 0 : force / (kOmega * kOmega) * (1 - std::cos(kOmega * since_s));
}

struct Driven : Ensemble {
  Driven(int points, InputSpecification force) : Ensemble("mass_spring_damper", points, {"x"}) {
    Set("m", 1);
    Set("k", kOmega * kOmega);
    Drive("force", std::move(force), 2);
  }
};

class DelayedInput : public ::testing::TestWithParam<IntegrationMethod> {};
INSTANTIATE_TEST_SUITE_P(AllMethods, DelayedInput,
                         ::testing::Values(IntegrationMethod::kExplicit,
                                           IntegrationMethod::kStiff));

TEST_P(DelayedInput, ActsOnEachPointAtItsOwnTime) {
  Driven ensemble(3, StepInput{.amplitude = 1, .time_s = 0.5});
  ensemble.specification.integration.method = GetParam();
  ensemble.specification.input_delays_s.resize(3, 1);
  ensemble.specification.input_delays_s << 0, 0.1, 0.7371;
  const std::vector<double> times_s = TimesUntil(3, 0.1);
  const Matrix x = ensemble.Propagate(times_s);
  for (int q = 0; q < 3; ++q) {
    const double start_s = 0.5 + ensemble.specification.input_delays_s(q, 0);
    for (size_t k = 0; k < times_s.size(); ++k) {
      const double expected = StepResponse(2, times_s[k] - start_s);
      EXPECT_NEAR(x(q, static_cast<Eigen::Index>(k)), expected, kTolerance * 2 / 9 * 4)
          << q << " " << times_s[k];
      if (times_s[k] < start_s) {
        EXPECT_EQ(x(q, static_cast<Eigen::Index>(k)), 0);
      }
    }
  }
}

TEST(DelayedInput, OfACornerIsFollowedByErrorControl) {
  // The input is a ramp from 0 at 0.5 s to 1 at 1.5 s; its response is the integral of step
  // responses.
  Driven ensemble(2, TableInput{.time_s = {0.5, 1.5}, .value = {0, 1}});
  ensemble.specification.input_delays_s.resize(2, 1);
  ensemble.specification.input_delays_s << 0, 0.3;
  const Matrix x = ensemble.Propagate({1.0, 1.3});
  const auto ramp = [](double since_s) {
    return 2 / (kOmega * kOmega) * (since_s - std::sin(kOmega * since_s) / kOmega);
  };
  EXPECT_NEAR(x(0, 0), ramp(0.5), kTolerance);
  EXPECT_NEAR(x(1, 1), ramp(0.5), kTolerance);
}

TEST(DelayedInput, OfAStreamIsThatOfATable) {
  const std::vector<double> times_s = TimesUntil(2, 0.05);
  std::vector<double> force;
  for (const double t : times_s) force.push_back(std::sin(7 * t) + 0.3);
  for (const Interpolation curve : {Interpolation::kHold, Interpolation::kCubic}) {
    Driven streamed(3, StreamedInput{curve, 1});
    Driven table(3, TableInput{times_s, force, curve, 1});
    for (Driven* ensemble : {&streamed, &table}) {
      ensemble->specification.input_delays_s.resize(3, 1);
      ensemble->specification.input_delays_s << 0.013, 0.2, 0.05;
    }
    for (size_t k = 0; k < times_s.size(); ++k) streamed.inputs[0].Append(times_s[k], force[k]);
    streamed.inputs[0].Finish();
    const Matrix difference = streamed.Propagate(times_s) - table.Propagate(times_s);
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), kTolerance);
  }
}

TEST(DelayedInput, MakesNoDifferenceWhenAllAreTheSameButItsTime) {
  Driven ensemble(2, HalfSineBumpInput{.amplitude = 1, .start_s = 0.2, .duration_s = 0.3});
  ensemble.specification.input_delays_s = Matrix::Constant(2, 1, 0.25);
  Driven late(2, HalfSineBumpInput{.amplitude = 1, .start_s = 0.45, .duration_s = 0.3});
  const std::vector<double> times_s = TimesUntil(2, 0.1);
  EXPECT_LT((ensemble.Propagate(times_s) - late.Propagate(times_s)).cwiseAbs().maxCoeff(),
            kTolerance);
}

TEST(InputOffset, IsAConstantForceOnItsPoint) {
  Driven ensemble(2, ConstantInput{});
  ensemble.specification.amplitudes.setZero();
  ensemble.specification.input_offsets.resize(2, 1);
  ensemble.specification.input_offsets << 0, 5;
  const Matrix x = ensemble.Propagate({0.7});
  EXPECT_EQ(x(0, 0), 0);
  EXPECT_NEAR(x(1, 0), StepResponse(5, 0.7), kTolerance);
}

TEST(OutputChannel, MultipliesAndShiftsWhatTheModelGives) {
  Driven plain(2, StepInput{.amplitude = 1, .time_s = 0});
  Driven ensemble = plain;
  ensemble.specification.output_gains.resize(2, 1);
  ensemble.specification.output_gains << 3, -1;
  ensemble.specification.output_offsets.resize(2, 1);
  ensemble.specification.output_offsets << 0.5, 10;
  const std::vector<double> times_s = {0, 0.4, 0.8};
  const Matrix x = plain.Propagate(times_s);
  const Matrix y = ensemble.Propagate(times_s);
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_EQ(y(0, k), 3 * x(0, k) + 0.5);
    EXPECT_EQ(y(1, k), -x(1, k) + 10);
  }
}

// A failed trajectory is replaced by a copy of another, including its channels.
TEST(DelayedInput, SurvivesTheFailureOfAPoint) {
  Driven ensemble(2, StepInput{.amplitude = 1, .time_s = 0.5});
  ensemble.Set("m", 0, std::numeric_limits<double>::quiet_NaN());
  ensemble.specification.input_delays_s.resize(2, 1);
  ensemble.specification.input_delays_s << 0.1, 0.2;
  const Matrix x = ensemble.Propagate({1.5});
  EXPECT_TRUE(std::isnan(x(0, 0)));
  EXPECT_NEAR(x(1, 0), StepResponse(2, 0.8), kTolerance);
  ASSERT_EQ(ensemble.failures.size(), 1u);
  EXPECT_EQ(ensemble.failures[0].point, 0);
}

}  // namespace
}  // namespace polyest::internal
