#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/unit/core/propagation/ensemble.h"
#include "tests/unit/core/propagation/oscillator.h"

namespace polyest::internal {
namespace {

const std::vector<double> kTimes = TimesUntil(4, 0.1);

// Makes softening springs k − |k3| x², whose potential has a ridge at x = √(k/|k3|).
Ensemble SofteningSprings(int points) {
  Ensemble ensemble("duffing", points, {"x", "v"});
  ensemble.Set("c", 0);
  ensemble.Set("k3", -1);
  for (int point = 0; point < points; ++point) ensemble.Set("x0", point, 0.2 + 0.01 * point);
  ensemble.specification.integration.relative_tolerance = 1e-8;
  return ensemble;
}

// Returns the finite time at which the motion from x0 beyond the ridge reaches infinity,
//   t* = ∫_{x0}^∞ dx/√((x⁴ − x0⁴)/2 − (x² − x0²)),
// by the midpoint rule after x = x0/(1 − s²), which removes the root at x0.
double BlowUpTime(double x0) {
  double sum = 0;
  constexpr int kCells = 20'000;
  for (int i = 0; i < kCells; ++i) {
    const double s = (i + 0.5) / kCells;
    const double x = x0 / (1 - s * s);
    const double dx = 2 * x0 * s / ((1 - s * s) * (1 - s * s));
    sum += dx / std::sqrt((std::pow(x, 4) - std::pow(x0, 4)) / 2 - (x * x - x0 * x0)) / kCells;
  }
  return sum;
}

class PointFailures : public ::testing::TestWithParam<IntegrationMethod> {};

TEST_P(PointFailures, NameThePointThatBlowsUpAndTheTime) {
  Ensemble ensemble = SofteningSprings(20);
  ensemble.specification.integration.method = GetParam();
  ensemble.Set("x0", 13, 2.0);
  const Matrix y = ensemble.Propagate(kTimes);
  ASSERT_EQ(ensemble.failures.size(), 1u);
  const PointFailure& failure = ensemble.failures[0];
  EXPECT_EQ(failure.point, 13);
  EXPECT_NEAR(failure.time_s, BlowUpTime(2.0), 1e-4);
  EXPECT_FALSE(failure.reason.empty());
  EXPECT_TRUE(y.row(13).tail(40).array().isNaN().all());
  EXPECT_TRUE(y.topRows(13).allFinite());
  EXPECT_TRUE(y.bottomRows(6).allFinite());
  EXPECT_EQ(y(13, 0), 2.0);
}

TEST_P(PointFailures, LeaveTheOthersAsAccurateAsWithoutThem) {
  Ensemble ensemble = SofteningSprings(20);
  ensemble.specification.integration.method = GetParam();
  const Matrix without = ensemble.Propagate(kTimes);
  EXPECT_TRUE(ensemble.failures.empty());
  ensemble.Set("x0", 3, 2.0);
  ensemble.Set("x0", 19, 3.0);  // The padding copies it.
  const Matrix with = ensemble.Propagate(kTimes);
  ASSERT_EQ(ensemble.failures.size(), 2u);
  EXPECT_EQ(ensemble.failures[0].point, 3);
  EXPECT_EQ(ensemble.failures[1].point, 19);
  for (int point = 0; point < 20; ++point) {
    if (point == 3 || point == 19) continue;
    // Both solutions have their own errors of some hundred steps of 1e-8.
    EXPECT_LT((with - without).row(point).cwiseAbs().maxCoeff(), 1e-6) << point;
  }
}

// Points that differ in what does not move the model blow up together, and those before and after
// them go on.
TEST_P(PointFailures, TakeNoOtherPointWhereSeveralBlowUpAtOnce) {
  Ensemble ensemble = SofteningSprings(20);
  ensemble.specification.integration.method = GetParam();
  for (const int point : {7, 11, 12, 18}) ensemble.Set("x0", point, 2.0);
  const Matrix y = ensemble.Propagate(kTimes);
  ASSERT_EQ(ensemble.failures.size(), 4u);
  std::vector<int> points;
  for (const PointFailure& failure : ensemble.failures) {
    points.push_back(failure.point);
    EXPECT_NEAR(failure.time_s, BlowUpTime(2.0), 1e-4);
  }
  EXPECT_THAT(points, ::testing::UnorderedElementsAre(7, 11, 12, 18));
  EXPECT_TRUE(y.topRows(7).allFinite());
  EXPECT_TRUE(y.row(19).allFinite());
}

TEST_P(PointFailures, MayTakeAllPoints) {
  Ensemble ensemble = SofteningSprings(10);
  ensemble.specification.integration.method = GetParam();
  for (int point = 0; point < 10; ++point) ensemble.Set("x0", point, 2 + 0.1 * point);
  const Matrix y = ensemble.Propagate(kTimes);
  ASSERT_EQ(ensemble.failures.size(), 10u);
  for (int point = 0; point < 10; ++point) EXPECT_EQ(ensemble.failures[point].point, point);
  EXPECT_TRUE(y.rightCols(1).array().isNaN().all());
}

TEST_P(PointFailures, IncludeDerivativesThatAreNotFiniteFromTheStart) {
  Ensemble ensemble = SofteningSprings(9);
  ensemble.specification.integration.method = GetParam();
  ensemble.Set("m", 4, 0.0);
  const Matrix y = ensemble.Propagate(kTimes);
  ASSERT_EQ(ensemble.failures.size(), 1u);
  EXPECT_EQ(ensemble.failures[0].point, 4);
  EXPECT_LT(ensemble.failures[0].time_s, 1e-20);  // ERKStep names the end of its last attempt
  EXPECT_TRUE(y.row(4).rightCols(79).array().isNaN().all());
  EXPECT_TRUE(y.topRows(4).allFinite());
  EXPECT_TRUE(y.bottomRows(4).allFinite());
  EXPECT_NE(y(5, 79), 0);
}

INSTANTIATE_TEST_SUITE_P(AllMethods, PointFailures,
                         ::testing::Values(IntegrationMethod::kExplicit, IntegrationMethod::kStiff,
                                           IntegrationMethod::kAuto));

TEST(PointFailures, IncludeInitialStatesThatAreNotFinite) {
  Ensemble ensemble = SofteningSprings(9);
  ensemble.Set("x0", 8, std::numeric_limits<double>::quiet_NaN());
  ensemble.Set("v0", 2, std::numeric_limits<double>::infinity());
  const EnsemblePropagator propagator(ensemble.specification, &ensemble.inputs);
  ASSERT_EQ(propagator.failures().size(), 2u);
  EXPECT_EQ(propagator.failures()[0].point, 2);
  EXPECT_EQ(propagator.failures()[1].point, 8);
  EXPECT_THAT(propagator.failures()[1].reason, ::testing::HasSubstr("initial state"));
}

TEST(PointFailures, IncludeOutputsThatAreNotFinite) {
  Ensemble ensemble("mass_spring_frequency", 4, {"omega"});
  ensemble.Set("k", 2, -1.0);
  const Matrix omega = ensemble.Propagate({0, 1});
  ASSERT_EQ(ensemble.failures.size(), 1u);
  EXPECT_EQ(ensemble.failures[0].point, 2);
  EXPECT_TRUE(std::isnan(omega(2, 0)));
  EXPECT_GT(omega(1, 1), 0);
}

// ω = √(k/m) is 10¹⁰⁵ at one point and 10⁹⁸ at another, whose squares are still far from overflow.
TEST(PointFailures, IncludeOutputsWhoseSquaresCouldOverflow) {
  Ensemble ensemble("mass_spring_frequency", 4, {"omega"});
  ensemble.Set("m", 1.0);
  ensemble.Set("k", 1, 1e210);
  ensemble.Set("k", 2, 1e196);
  const Matrix omega = ensemble.Propagate({0, 1});
  ASSERT_EQ(ensemble.failures.size(), 1u);
  EXPECT_EQ(ensemble.failures[0].point, 1);
  EXPECT_EQ(ensemble.failures[0].reason, "an output exceeds 1e100 in magnitude");
  EXPECT_TRUE(omega.row(1).array().isNaN().all());
  EXPECT_DOUBLE_EQ(omega(2, 1), 1e98);
}

// Follows x″ = −x, but the derivative of a point is NaN once t passes its time of death.
class Mortal final : public StateSpaceModel {
 public:
  const ModelDescription& description() const override { return description_; }
  void InitialStates(const ConstBlock&, Block states) const override {
    states.col(0).setOnes();
    states.col(1).setZero();
  }
  void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                   const ConstBlock&, Block derivatives) const override {
    derivatives.col(0) = states.col(1);
    derivatives.col(1) = (parameters.col(0) < time_s)
                             .select(std::numeric_limits<double>::quiet_NaN(), -states.col(0));
  }
  void Outputs(double, const ConstBlock& states, const ConstBlock&, const ConstBlock&,
               Block outputs) const override {
    outputs.col(0) = states.col(0);
  }

 private:
  const ModelDescription description_ = [] {
    ModelDescription description;
    description.name = "mortal";
    description.states = {{"x", "m", "displacement"}, {"v", "m/s", "velocity"}};
    description.parameters = {{"death", "s", "when it stops being defined"}};
    description.outputs = {{"x", "m", "displacement"}};
    return description;
  }();
};

TEST_P(PointFailures, SpareTheHealthyWhenOthersStopBeingDefined) {
  EnsembleSpecification specification;
  specification.model = std::make_shared<Mortal>();
  specification.parameters = Matrix::Constant(12, 1, std::numeric_limits<double>::max());
  specification.parameters(3, 0) = 1;
  specification.parameters(7, 0) = 1.5;
  specification.amplitudes.resize(12, 0);
  specification.outputs = {0};
  specification.integration.method = GetParam();
  const InputSignals inputs;
  EnsemblePropagator propagator(specification, &inputs);
  Matrix outputs(12, 2);
  ASSERT_TRUE(propagator.Advance(std::vector<double>{0.5, 2}, outputs, Stop()).ok());
  ASSERT_EQ(propagator.failures().size(), 2u);
  EXPECT_EQ(propagator.failures()[0].point, 3);
  EXPECT_EQ(propagator.failures()[1].point, 7);
  // The healthy points follow cos t well within the sum of 1e-7 a step.
  EXPECT_NEAR(outputs(0, 1), std::cos(2.0), 1e-4);
}

TEST(PointFailures, NameTheStepsThatRanOut) {
  Ensemble ensemble("mass_spring_damper", 8, {"x"});
  ensemble.Set("v0", 1.0);
  ensemble.Set("k", 3, 1e8);  // 5 kHz
  ensemble.specification.integration.method = IntegrationMethod::kExplicit;
  ensemble.specification.integration.max_steps = 1000;
  ensemble.Propagate({0, 1});
  ASSERT_EQ(ensemble.failures.size(), 1u);
  EXPECT_EQ(ensemble.failures[0].point, 3);
  EXPECT_THAT(ensemble.failures[0].reason, ::testing::HasSubstr("too many steps"));
  EXPECT_LT(ensemble.failures[0].time_s, 1);
}

// Of 5 kHz one second takes far more than 5,000 steps, and a hundredth fewer than 999.
TEST(PointFailures, HaveAllStepsThatAreAllowed) {
  const auto reached_s = [](int max_steps) {
    Ensemble ensemble("mass_spring_damper", 1, {"x"});
    ensemble.Set("v0", 1.0);
    ensemble.Set("k", 1e8);
    ensemble.specification.integration.method = IntegrationMethod::kExplicit;
    ensemble.specification.integration.max_steps = max_steps;
    ensemble.Propagate({0, 1});
    return ensemble.failures.at(0).time_s;
  };
  EXPECT_GT(reached_s(999), 1.5 * reached_s(500));
}

// The limit counts for what is measured.
TEST(PointFailures, IncludeOutputsThatTheirGainTakesBeyondTheLimit) {
  Ensemble ensemble("mass_spring_damper", 3, {"x"});
  ensemble.Set("x0", 1.0);
  ensemble.specification.output_gains = Matrix::Ones(3, 1);
  ensemble.specification.output_gains(1, 0) = 1e160;
  const Matrix y = ensemble.Propagate({0, 1, 2});
  ASSERT_EQ(ensemble.failures.size(), 1u);
  EXPECT_EQ(ensemble.failures[0].point, 1);
  EXPECT_EQ(ensemble.failures[0].time_s, 0);
  EXPECT_THAT(ensemble.failures[0].reason, ::testing::HasSubstr("with its gain and offset"));
  EXPECT_TRUE(y.row(1).array().isNaN().all());
  EXPECT_TRUE(y.row(0).allFinite() && y.row(2).allFinite());
}

}  // namespace
}  // namespace polyest::internal
