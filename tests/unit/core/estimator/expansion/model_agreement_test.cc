// The bound on what an expansion's error does to an estimate. The model is
//   y = a sin t + q a² sin 3t,   |a| < 1,
// whose second term an expansion of order 1 takes for a constant times sin 3t. Over whole periods
// the two sines are orthogonal. A record a_0 sin t + e sin 3t has its minimum of the cost at a_0 on
// the expansion, and with the model at a root of a − a_0 = 2 q a (e − q a²).

#include "core/estimator/expansion/model_agreement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "core/estimator/posterior/noise_learning.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::agreement {
namespace {

constexpr int kRows = 400, kPeriods = 4;
constexpr double kCurvature = 0.002;  // q
constexpr double kAmplitude = 0.5;    // a_0
constexpr double kNoise = 1;
const double kDeviation = kNoise / std::sqrt(kRows / 2.0);  // of a, as Σ sin² = N/2

class ModelAgreementTest : public ::testing::Test {
 protected:
  void SetUp() override {
    EquationSpecification equations;
    equations.outputs = {{"y", "a*sin(t) + q*a^2*sin(3*t)"}};
    equations.parameters = {{"q", kCurvature}};
    Problem problem;
    problem.model = MakeEquationModel(equations).value();
    problem.uncertain = {UncertainParameter::Uniform("a", -1, 1).value()};
    problem.measured = {{"y", {.absolute = kNoise}}};
    problem.expansion.order = 1;
    problem_ = std::make_unique<ResolvedProblem>(ResolvedProblem::Make(problem).value());
    expansion_ = RegionalExpansion::Make(*problem_, nullptr, DesignForPrior(*problem_).value(),
                                         NoiseToBeginWith(problem), 1)
                     .value();
  }

  // Takes a record that differs from a_0 sin t by `deviation` of the row and the time.
  void Take(const std::function<double(int, double)>& deviation) {
    RowBlock block;
    for (int k = 0; k < kRows; ++k) {
      const double t = 2 * std::numbers::pi * kPeriods * (k + 0.5) / kRows;
      block.rows.push_back({0, t});
      block.values.push_back(kAmplitude * std::sin(t) + deviation(k, t));
    }
    block.noise.assign(kRows, kNoise);
    ASSERT_TRUE(expansion_->Propagate(block, Stop()).ok());
    for (int row = 0; row < kRows; ++row) expansion_->Absorb(row);
  }

  Cost CostNow() const { return expansion_->MakeCost(problem_->problem().regularization); }

  // Returns ‖(model − expansion)/σ‖ at the worst check point.
  double LargestResidual() const {
    return DifferencesAtChecks(*expansion_, CostNow()).residuals.maxCoeff() * std::sqrt(kRows);
  }

  std::unique_ptr<ResolvedProblem> problem_;
  std::unique_ptr<RegionalExpansion> expansion_;
};

TEST_F(ModelAgreementTest, BoundsTheShiftWhereResidualsAreAlikeTheError) {
  constexpr double kMisfit = 5;  // e
  Take([](int, double t) { return kMisfit * std::sin(3 * t); });
  double a = kAmplitude;
  for (int i = 0; i < 50; ++i) {
    a = kAmplitude + 2 * kCurvature * a * (kMisfit - kCurvature * a * a);
  }
  const double shift = (a - kAmplitude) / kDeviation;
  EXPECT_GT(shift, 5 * LargestResidual());
  EXPECT_GE(AgreementWithModel(*expansion_, CostNow()).shift, shift);
}

TEST_F(ModelAgreementTest, IsTheResidualWhereSamplesAreIndependent) {
  Take([](int row, double) { return row % 2 == 0 ? kNoise : -kNoise; });
  EXPECT_DOUBLE_EQ(AgreementWithModel(*expansion_, CostNow()).shift,
                   LargestResidual() + expansion_->RoundingError());
}

}  // namespace
}  // namespace polyest::internal::agreement
