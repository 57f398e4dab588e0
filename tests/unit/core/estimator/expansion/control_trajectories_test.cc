// Errors of integration that all trajectories have in common. The model turns on a circle,
// x = cos w t, as fast as its distance from the centre squared, so that the error of its amplitude,
// which grows, drives that of its phase.

#include "core/estimator/expansion/control_trajectories.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/estimator/posterior/noise_learning.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

constexpr double kAngularVelocity = 6;

Problem CirclingProblem(double noise) {
  EquationSpecification equations;
  equations.states = {{"x", "-w * y * (x^2 + y^2)"}, {"y", "w * x * (x^2 + y^2)"}};
  equations.outputs = {{"z", "x"}};
  Problem problem;
  problem.model = MakeEquationModel(equations).value();
  problem.fixed = {{"x_0", 1}};
  problem.uncertain = {UncertainParameter::Uniform("w", 5.9, 6.1).value()};
  problem.measured = {{"z", {.absolute = noise}}};
  return problem;
}

Samples CirclingRecord(int rows, double interval_s) {
  Samples samples;
  samples.columns = {{"z", {}, {}}};
  for (int k = 1; k <= rows; ++k) {
    samples.time_s.push_back(k * interval_s);
    samples.columns[0].value.push_back(std::cos(kAngularVelocity * k * interval_s));
  }
  return samples;
}

RowBlock BlockOf(const Samples& samples, double noise) {
  RowBlock block;
  for (const double time_s : samples.time_s) block.rows.push_back({0, time_s});
  block.values = samples.columns[0].value;
  block.noise.assign(samples.rows(), noise);
  return block;
}

// An expansion over the prior and, beside it, the trajectories that it should have made.
class CirclingExpansion : public ::testing::Test {
 protected:
  static constexpr double kNoise = 3;  // so that all check points have a weight
  static constexpr int kRows = 50;
  static constexpr double kInterval_s = 0.3;

  void SetUp() override {
    Problem problem = CirclingProblem(kNoise);
    problem.expansion.order = 3;
    problem.integration.relative_tolerance = 1e-4;
    problem_ = std::make_unique<ResolvedProblem>(ResolvedProblem::Make(problem).value());
    expansion_ = RegionalExpansion::Make(*problem_, nullptr, DesignForPrior(*problem_).value(),
                                         NoiseToBeginWith(problem), 1)
                     .value();
    const RowBlock block = BlockOf(CirclingRecord(kRows, kInterval_s), kNoise);
    ASSERT_TRUE(expansion_->Propagate(block, Stop()).ok());
    for (int row = 0; row < kRows; ++row) expansion_->Absorb(row);
  }

  // Returns the output at the rows' times of a trajectory for each local coordinate.
  Matrix Outputs(const Vector& etas, double tolerance) const {
    Matrix thetas(etas.size(), 1);
    for (Eigen::Index i = 0; i < etas.size(); ++i) {
      thetas.row(i) = problem_->prior().ToParameters(etas.segment(i, 1)).transpose();
    }
    InputSignals inputs = problem_->MakeInputs();
    EnsembleSpecification specification = problem_->MakeEnsemble(thetas, problem_->outputs(), 1, 0);
    specification.integration.relative_tolerance = tolerance;
    EnsemblePropagator propagator(std::move(specification), &inputs);
    Matrix outputs(etas.size(), kRows);
    EXPECT_TRUE(
        propagator.Advance(CirclingRecord(kRows, kInterval_s).time_s, outputs, Stop()).ok());
    return outputs;
  }

  std::unique_ptr<ResolvedProblem> problem_;
  std::unique_ptr<RegionalExpansion> expansion_;
};

TEST_F(CirclingExpansion, SumsTheScoresOfItsControls) {
  const ExpansionDesign& design = expansion_->design();
  const auto checks = static_cast<int>(design.check_points.rows());
  ASSERT_EQ(expansion_->controls(), checks);
  Vector etas(design.points.rows() + checks);
  etas << design.points.col(0), design.check_points.col(0);
  const Matrix outputs = Outputs(etas, 1e-4);
  const Matrix controls = Outputs(design.check_points.col(0), 1e-5);
  CollocationMatrix matrix = CollocationMatrix::Factor(*design.basis, design.points).value();
  Matrix coefficients(design.basis->size(), kRows);
  Vector residual(kRows);
  matrix.Solve(outputs.topRows(design.points.rows()), coefficients, residual);
  const Vector variance = kNoise * kNoise + residual.array();
  double largest = 0;
  for (int i = 0; i < checks; ++i) {
    EXPECT_TRUE(expansion_->IsControlValid(i));
    // Σ c_k δ_k/R_k
    const Vector difference = (controls.row(i) - outputs.row(design.points.rows() + i)).transpose();
    const Vector expected = coefficients * difference.cwiseQuotient(variance);
    EXPECT_GT(expected.norm(), 0);
    EXPECT_LE((expansion_->ControlScore(i, 0) - expected).norm(), 1e-12 * expected.norm());
    // g = ∂φ c, s = Σ g δ/R, H = Σ g²/R + 3, since a uniform germ on (−1, 1) has the variance 1/3.
    Vector phi(design.basis->size());
    Matrix slope(design.basis->size(), 1);
    design.basis->EvaluateWithGradient(design.check_points.row(i).transpose(), phi, slope);
    const Vector g = coefficients.transpose() * slope.col(0);
    const double s = g.dot(difference.cwiseQuotient(variance));
    const double h = g.dot(g.cwiseQuotient(variance)) + 3;
    largest = std::max(largest, std::abs(s) / std::sqrt(h));
  }
  EXPECT_NEAR(IntegrationShift(*expansion_, expansion_->MakeCost(1)), largest, 1e-9 * largest);
}

int ControlsOf(const Problem& problem) {
  const ResolvedProblem resolved = ResolvedProblem::Make(problem).value();
  return RegionalExpansion::Make(resolved, nullptr, DesignForPrior(resolved).value(),
                                 NoiseToBeginWith(problem), 1)
      .value()
      ->controls();
}

TEST(ControlTrajectories, AreForModelsThatAreIntegrated) {
  Problem problem = CirclingProblem(0.01);
  EXPECT_EQ(ControlsOf(problem), CheckCount(1));
  // A tolerance that leaves no room for a smaller one.
  problem.integration.relative_tolerance = 1e-13;
  EXPECT_EQ(ControlsOf(problem), 0);
  // A model that steps exactly, unless another method is asked for.
  problem = InitialVelocityProblem(UncertainParameter::Uniform("v0", 0.5, 1.5).value(), 0.01);
  EXPECT_EQ(ControlsOf(problem), 0);
  problem.integration.method = IntegrationMethod::kExplicit;
  EXPECT_EQ(ControlsOf(problem), CheckCount(1));
  // A model without states.
  problem = TextProblem("a", {UncertainParameter::Uniform("a", 0, 1).value()}, 0.01);
  EXPECT_EQ(ControlsOf(problem), 0);
}

Estimate AtTolerance(double tolerance) {
  Problem problem = CirclingProblem(0.01);
  problem.integration.relative_tolerance = tolerance;
  problem.tolerance_follows_noise = false;
  return EstimateOf(problem, CirclingRecord(500, 0.2));
}

// With the coarse tolerance the estimate is off by many standard deviations. The controls tell by
// how many it is from the estimate with a tenth of the tolerance, to first order.
TEST(ControlTrajectories, FindOutATooCoarseTolerance) {
  const Estimate coarse = AtTolerance(3e-6), tenth = AtTolerance(3e-7), fine = AtTolerance(1e-11);
  const ParameterEstimate& w = coarse.parameters[0];
  const ParameterEstimate& exact = fine.parameters[0];
  EXPECT_NEAR(exact.mean, kAngularVelocity, 0.02 * exact.posterior_std_dev);
  EXPECT_FALSE(Has(fine, DiagnosticCode::kExpansionInaccurate));
  const double shift = std::abs(w.mean - tenth.parameters[0].mean) / exact.posterior_std_dev;
  EXPECT_GT(shift, 5);
  EXPECT_THAT(Message(coarse, DiagnosticCode::kExpansionInaccurate),
              HasSubstr("integration.relativeTolerance"));
  EXPECT_NEAR(w.posterior_std_dev / exact.posterior_std_dev, std::hypot(1, shift), 0.1 * shift);
  EXPECT_LT(w.lower95, kAngularVelocity);
  EXPECT_GT(w.upper95, kAngularVelocity);
}

// The tolerance that the noise of the samples asks for leaves an error of more than a standard
// deviation, since the phase's error grows with the square of the time.
TEST(ControlTrajectories, LetTheToleranceFollow) {
  const Estimate estimate = EstimateOf(CirclingProblem(0.001), CirclingRecord(150, 2));
  const ParameterEstimate& w = estimate.parameters[0];
  EXPECT_NEAR(w.mean, kAngularVelocity, 0.1 * w.posterior_std_dev);
  EXPECT_EQ(w.verdict, Verdict::kIdentified);
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kExpansionInaccurate));
}

TEST(ControlTrajectories, AreAFunctionOfTheRowsAlone) {
  const Problem problem = CirclingProblem(0.01);
  const Samples record = CirclingRecord(100, 1);
  const auto estimator = MakeEstimator(problem);
  for (size_t row = 0; row < record.rows(); ++row) {
    Samples one;
    one.time_s = {record.time_s[row]};
    one.columns = {{"z", {record.columns[0].value[row]}, {}}};
    ASSERT_TRUE(estimator->Append(one).ok());
    if (row % 7 == 0) {
      ASSERT_TRUE(estimator->Process().ok());
    }
  }
  ASSERT_TRUE(estimator->Process().ok());
  ExpectSame(estimator->CurrentEstimate().value(), EstimateOf(problem, record));
}

}  // namespace
}  // namespace polyest::internal
