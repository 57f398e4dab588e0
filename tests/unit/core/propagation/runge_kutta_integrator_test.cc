// Tests the explicit integrator with oscillators whose motion is known, and against CVODE.

#include "core/propagation/runge_kutta_integrator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "core/propagation/bdf_integrator.h"

namespace polyest::internal {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr int kMaxSteps = 1'000'000;

// Oscillators x″ = −ω² x − d |x′| x′ with ω = 1 … 1.7. Counts the evaluations.
class Oscillators final : public BlockSystem {
 public:
  explicit Oscillators(double damping = 0) : damping_(damping) {}
  Eigen::Index points() const override { return kLanes; }
  Eigen::Index states() const override { return 2; }
  void Derivatives(double, const ConstBlock& states, Block derivatives) override {
    ++evaluations_;
    for (Eigen::Index p = 0; p < kLanes; ++p) {
      const double x = states(p, 0), v = states(p, 1);
      derivatives(p, 0) = v;
      derivatives(p, 1) = -Omega(p) * Omega(p) * x - damping_ * std::abs(v) * v;
    }
  }
  static double Omega(Eigen::Index p) { return 1 + 0.1 * static_cast<double>(p); }
  static Eigen::ArrayXXd Start() {
    Eigen::ArrayXXd states = Eigen::ArrayXXd::Zero(kLanes, 2);
    states.col(0) = 1;
    return states;
  }
  // The largest error of x without damping.
  static double Error(const Eigen::ArrayXXd& states, double time_s) {
    double largest = 0;
    for (Eigen::Index p = 0; p < kLanes; ++p) {
      largest = std::max(largest, std::abs(states(p, 0) - std::cos(Omega(p) * time_s)));
    }
    return largest;
  }
  double evaluations() const { return static_cast<double>(evaluations_); }

 private:
  double damping_;
  int64_t evaluations_ = 0;
};

class RungeKutta : public ::testing::TestWithParam<double> {};

// A step adds an error of at most the tolerance times a state's largest magnitude, and an
// oscillator does not amplify it, up to its largest ω in the units of x. There are at most as many
// steps as sixths of evaluations.
TEST_P(RungeKutta, AddsAtMostTheToleranceInEachStep) {
  const double tolerance = GetParam();
  Oscillators system;
  const auto integrator = MakeRungeKuttaIntegrator(&system, tolerance, 0, Oscillators::Start());
  Eigen::ArrayXXd states = Oscillators::Start();
  double largest = 0;
  // Samples lie between steps, at the end of the steps, or several in one.
  for (double time_s = 0.05; time_s < 60; time_s += 0.05) {
    ASSERT_TRUE(integrator->AdvanceTo(time_s, kNever, kMaxSteps, states).ok);
    largest = std::max(largest, Oscillators::Error(states, time_s));
  }
  EXPECT_LT(largest, tolerance * 1.7 * system.evaluations() / 6);
}

INSTANTIATE_TEST_SUITE_P(Tolerances, RungeKutta, ::testing::Values(1e-4, 1e-6, 1e-8, 1e-10, 1e-12));

// The evaluations grow like tolerance^(−1/order): to 10^(3/8) = 2.4 times as many at a thousandth
// of the tolerance by order 8, to 10^(3/5) = 4.0 times as many by order 5.
TEST(RungeKutta, GoesOverToOrder8WhereNothingStopsIt) {
  const auto evaluations = [](double tolerance) {
    Oscillators system;
    const auto integrator = MakeRungeKuttaIntegrator(&system, tolerance, 0, Oscillators::Start());
    Eigen::ArrayXXd states = Oscillators::Start();
    EXPECT_TRUE(integrator->AdvanceTo(600, kNever, kMaxSteps, states).ok);
    return system.evaluations();
  };
  EXPECT_LT(evaluations(1e-12) / evaluations(1e-9), 3);
}

TEST(RungeKutta, TakesOneStepOfOrder5FromStopToStopWhereTheyAreDense) {
  Oscillators system;
  const auto integrator = MakeRungeKuttaIntegrator(&system, 1e-7, 0, Oscillators::Start());
  Eigen::ArrayXXd states = Oscillators::Start();
  constexpr int kStops = 5'000;
  for (int k = 1; k <= kStops; ++k) {
    ASSERT_TRUE(integrator->AdvanceTo(0.01 * k, 0.01 * k, kMaxSteps, states).ok);
  }
  EXPECT_LT(system.evaluations(), 6.1 * kStops);
  EXPECT_LT(Oscillators::Error(states, 0.01 * kStops), 1e-9);
}

TEST(RungeKutta, AgreesWithBackwardDifferentiation) {
  Oscillators system(0.3);
  constexpr double kTolerance = 1e-10;
  const auto explicit_one = MakeRungeKuttaIntegrator(&system, kTolerance, 0, Oscillators::Start());
  const auto stiff_one = MakeBdfIntegrator(&system, kTolerance, 0, Oscillators::Start());
  Eigen::ArrayXXd one = Oscillators::Start(), other = one;
  for (int k = 1; k <= 100; ++k) {
    ASSERT_TRUE(explicit_one->AdvanceTo(0.2 * k, kNever, kMaxSteps, one).ok);
    ASSERT_TRUE(stiff_one->AdvanceTo(0.2 * k, kNever, kMaxSteps, other).ok);
    // BDF needs some thousand steps, each of which may add the tolerance.
    EXPECT_LT((one - other).abs().maxCoeff(), 5'000 * kTolerance);
  }
}

TEST(RungeKutta, GoesOnFromOtherStates) {
  Oscillators system;
  const auto integrator = MakeRungeKuttaIntegrator(&system, 1e-9, 0, Oscillators::Start());
  Eigen::ArrayXXd states = Oscillators::Start();
  ASSERT_TRUE(integrator->AdvanceTo(1.3, 1.3, kMaxSteps, states).ok);
  ASSERT_TRUE(integrator->RestartFrom(Oscillators::Start()));
  EXPECT_TRUE((integrator->states() == Oscillators::Start()).all());
  ASSERT_TRUE(integrator->AdvanceTo(3.3, 3.3, kMaxSteps, states).ok);
  EXPECT_LT(Oscillators::Error(states, 2), 1e-7);
}

TEST(RungeKutta, NeverStepsPastAStop) {
  Oscillators system;
  const auto integrator = MakeRungeKuttaIntegrator(&system, 1e-6, 0, Oscillators::Start());
  Eigen::ArrayXXd states = Oscillators::Start();
  ASSERT_TRUE(integrator->AdvanceTo(0.1, 2, kMaxSteps, states).ok);
  ASSERT_TRUE(integrator->AdvanceTo(2, 2, kMaxSteps, states).ok);
  integrator->Restart();  // requires that the stop was reached exactly
  EXPECT_EQ(integrator->time_s(), 2);
  EXPECT_LT(Oscillators::Error(states, 2), 1e-4);
}

TEST(RungeKutta, SaysThatItHasUsedItsSteps) {
  Oscillators system;
  const auto integrator = MakeRungeKuttaIntegrator(&system, 1e-9, 0, Oscillators::Start());
  Eigen::ArrayXXd states = Oscillators::Start();
  const IntegratorOutcome outcome = integrator->AdvanceTo(1e4, kNever, 50, states);
  EXPECT_FALSE(outcome.ok);
  EXPECT_TRUE(outcome.too_many_steps);
  EXPECT_GT(integrator->time_s(), 0);
  EXPECT_LT(Oscillators::Error(integrator->states(), integrator->time_s()), 1e-7);
}

}  // namespace
}  // namespace polyest::internal
