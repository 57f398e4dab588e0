#include "core/bayes/robust_samples.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/bayes/noise.h"

namespace polyest::internal::robust_samples_test {
namespace {

constexpr int kTerms = 5, kSamples = 37;

class RobustSamplesOf : public ::testing::TestWithParam<OutlierHandling> {
 protected:
  RobustSamplesOf() : samples_(GetParam(), kTerms) {
    for (int k = 0; k < kSamples; ++k) {
      samples_.Add(coefficients_.col(k), errors_[k], variances_[k]);
    }
  }

  const Matrix coefficients_ = Matrix::Random(kTerms, kSamples);
  const Vector errors_ = 10 * Vector::Random(kSamples);
  const Vector variances_ = Vector::Random(kSamples).array() + 1.5;
  RobustSamples samples_;
};

TEST_P(RobustSamplesOf, SumTheLossOfEach) {
  const Matrix points = Matrix::Random(9, kTerms);
  Vector values = Vector::Ones(9);
  Matrix product;
  samples_.AddTo(values, points, product);
  for (int i = 0; i < 9; ++i) {
    const Vector d = points.row(i).transpose();
    double expected = 0;
    for (int k = 0; k < kSamples; ++k) {
      const double u = (errors_[k] - coefficients_.col(k).dot(d)) / std::sqrt(variances_[k]);
      expected += RobustLoss(GetParam(), u);
    }
    EXPECT_NEAR(samples_.Evaluate(d), expected, 1e-12 * expected);
    EXPECT_NEAR(values[i] - 1, expected, 1e-12 * expected);
  }
}

// A central difference of second order with the step h is wrong by about h² and by rounding/h.
TEST_P(RobustSamplesOf, HaveTheDerivativesOfTheirSum) {
  constexpr double kStep = 1e-5;
  const Vector d = Vector::Random(kTerms);
  Vector gradient = Vector::Zero(kTerms);
  EXPECT_NEAR(samples_.EvaluateAddingGradient(d, gradient), samples_.Evaluate(d), 1e-11);
  const Matrix curvature = samples_.Curvature(d, Matrix::Identity(kTerms, kTerms));
  for (int i = 0; i < kTerms; ++i) {
    const Vector step = kStep * Vector::Unit(kTerms, i);
    Vector above = Vector::Zero(kTerms), below = Vector::Zero(kTerms);
    const double slope = (samples_.EvaluateAddingGradient(d + step, above) -
                          samples_.EvaluateAddingGradient(d - step, below)) /
                         (2 * kStep);
    EXPECT_NEAR(gradient[i], slope, 1e-6 * gradient.norm());
    EXPECT_LT((curvature.col(i) - (above - below) / (2 * kStep)).norm(), 1e-6 * curvature.norm());
  }
}

// With d = Tᵀ d′ + δ the residuals are the same; half the variance of the noise doubles their
// squares.
TEST_P(RobustSamplesOf, AreTheSameByOtherTerms) {
  const Matrix t = Matrix::Random(3, kTerms);
  const Vector shift = Vector::Random(kTerms), d = Vector::Random(3);
  const RobustSamples moved = samples_.Substituted(t, shift);
  EXPECT_EQ(moved.count(), kSamples);
  EXPECT_TRUE(moved.IsValid(3));
  const double expected = samples_.Evaluate(t.transpose() * d + shift);
  EXPECT_NEAR(moved.Evaluate(d), expected, 1e-12 * expected);
}

INSTANTIATE_TEST_SUITE_P(ByEveryMethod, RobustSamplesOf,
                         ::testing::Values(OutlierHandling::kStudentT, OutlierHandling::kHuber));

// ∫ e^{−ρ(u) − ½ log 2π − lack} du = 1, by the midpoint rule; the tails of t beyond U are less than
// 12/U⁴, and Huber's are nothing.
TEST(RobustLoss, IsThatOfADensity) {
  constexpr double kStep = 1e-3, kEnd = 300;
  for (const OutlierHandling outliers :
       {OutlierHandling::kNone, OutlierHandling::kStudentT, OutlierHandling::kHuber}) {
    double sum = 0;
    for (double u = 0.5 * kStep; u < kEnd; u += kStep) {
      sum += 2 * kStep * std::exp(-RobustLoss(outliers, u) - LackOfDensity(outliers));
    }
    EXPECT_NEAR(sum / std::sqrt(2 * std::numbers::pi), 1, 1e-6) << static_cast<int>(outliers);
  }
}

}  // namespace
}  // namespace polyest::internal::robust_samples_test
