#include "core/bayes/curvature.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "core/bayes/identifiability.h"

namespace polyest::internal {
namespace {

Prior TwoNormals() {
  return Prior({UncertainParameter::Normal("a", 0, 2).value(),
                UncertainParameter::Normal("b", 5, 10).value()});
}

TEST(Curvature, OfWellInformedParametersIsTheInverseHessian) {
  Matrix hessian(2, 2);
  hessian << 40, 12, 12, 9;
  const Curvature curvature = CovarianceFromCurvature(hessian, TwoNormals(), Vector::Zero(2));
  const Eigen::DiagonalMatrix<double, 2> scale(2, 10);
  const Matrix expected = scale * hessian.inverse() * scale;
  EXPECT_TRUE(curvature.covariance.isApprox(expected, 1e-13));
  EXPECT_NEAR(curvature.standard_deviation[1], std::sqrt(expected(1, 1)), 1e-13);
  EXPECT_FALSE(curvature.limited_by_prior);
}

TEST(Curvature, KeepsThePriorWhereItKnowsLess) {
  for (const double unknown : {0.25, 0.0, -3.0}) {
    const Matrix hessian = Eigen::Vector2d(100, unknown).asDiagonal();
    const Curvature curvature = CovarianceFromCurvature(hessian, TwoNormals(), Vector::Zero(2));
    EXPECT_NEAR(curvature.standard_deviation[0], 0.2, 1e-14);
    EXPECT_NEAR(curvature.standard_deviation[1], 10, 1e-13);
    EXPECT_TRUE(curvature.limited_by_prior);
  }
}

TEST(Curvature, KeepsThePriorAlongAnObliqueValley) {
  // The data know the direction across (1, 1) with curvature 10⁴ and nothing along it, so that the
  // variance is ½ + ½·10⁻⁴ in each unit.
  const Eigen::Vector2d across(M_SQRT1_2, -M_SQRT1_2);
  const Matrix hessian = 1e4 * across * across.transpose();
  const Curvature curvature = CovarianceFromCurvature(hessian, TwoNormals(), Vector::Zero(2));
  EXPECT_NEAR(curvature.standard_deviation[0], 2 * std::sqrt(0.5 + 0.5e-4), 1e-12);
  EXPECT_NEAR(curvature.covariance(0, 1), 20 * (0.5 - 0.5e-4), 1e-11);
}

TEST(Curvature, IsMeasuredInPriorStandardDeviations) {
  // The prior, uniform on [0, 6], has the scale 3 and the germ deviation 1/√3. Its variance is 3 in
  // θ and ⅓ in ξ: a curvature of 3 is the prior's own, 12 halves the deviation.
  const Prior prior({UncertainParameter::Uniform("a", 0, 6).value()});
  const auto deviation = [&](double curvature) {
    return CovarianceFromCurvature(Matrix::Constant(1, 1, curvature), prior, Vector::Zero(1))
        .standard_deviation[0];
  };
  EXPECT_NEAR(deviation(2.9), std::sqrt(3.0), 1e-14);
  EXPECT_NEAR(deviation(12), std::sqrt(3.0) / 2, 1e-14);
}

TEST(Curvature, ThatIsNoNumberLeavesThePrior) {
  Matrix hessian = Matrix::Identity(2, 2);
  hessian(0, 1) = hessian(1, 0) = std::numeric_limits<double>::quiet_NaN();
  const Curvature curvature = CovarianceFromCurvature(hessian, TwoNormals(), Vector::Zero(2));
  EXPECT_EQ(curvature.standard_deviation, Vector(Eigen::Vector2d(2, 10)));
  EXPECT_TRUE(curvature.limited_by_prior);
}

TEST(Directions, AreSortedByInformationInPriorUnits) {
  const Prior prior({UncertainParameter::Uniform("a", 0, 6).value(),
                     UncertainParameter::Normal("b", 0, 1).value()});
  // The information is λ = (germ variance) × curvature: 6/3 = 2 and 50.
  const Matrix hessian = Eigen::Vector2d(6, 50).asDiagonal();
  const std::vector<Direction> directions = Directions(hessian, prior);
  ASSERT_EQ(directions.size(), 2u);
  EXPECT_NEAR(directions[0].information, 50, 1e-12);
  EXPECT_NEAR(directions[1].information, 2, 1e-12);
  EXPECT_EQ(directions[0].verdict, Verdict::kIdentified);
  EXPECT_EQ(directions[1].verdict, Verdict::kWeak);
  EXPECT_NEAR(directions[0].coefficients[1], 1, 1e-12);
  EXPECT_NEAR(directions[1].coefficients[0], 1, 1e-12);
}

TEST(Directions, CountNegativeCurvatureAsNoInformation) {
  const Matrix hessian = Eigen::Vector2d(-5, 3).asDiagonal();
  const std::vector<Direction> directions = Directions(hessian, TwoNormals());
  EXPECT_EQ(directions[1].information, 0);
  EXPECT_EQ(directions[1].verdict, Verdict::kNotIdentified);
}

TEST(Directions, HaveAPositiveLargestCoefficientAndUnitLength) {
  for (const double sign : {1.0, -1.0}) {
    const Eigen::Vector2d axis = sign * Eigen::Vector2d(0.6, -0.8);
    const std::vector<Direction> directions =
        Directions(100 * axis * axis.transpose(), TwoNormals());
    EXPECT_TRUE(directions[0].coefficients.isApprox(Eigen::Vector2d(-0.6, 0.8), 1e-12));
    EXPECT_NEAR(directions[1].coefficients.norm(), 1, 1e-14);
  }
}

TEST(Verdicts, ChangeAtTheirThresholds) {
  const auto verdict = [](double information) {
    return Directions(Matrix::Constant(1, 1, information),
                      Prior({UncertainParameter::Normal("a", 0, 1).value()}))[0]
        .verdict;
  };
  EXPECT_EQ(verdict(10), Verdict::kIdentified);
  EXPECT_EQ(verdict(9.99), Verdict::kWeak);
  EXPECT_EQ(verdict(1), Verdict::kWeak);
  EXPECT_EQ(verdict(0.99), Verdict::kNotIdentified);
  EXPECT_EQ(VerdictOfContraction(0.5), Verdict::kIdentified);
  EXPECT_EQ(VerdictOfContraction(0.51), Verdict::kWeak);
  EXPECT_EQ(VerdictOfContraction(0.89), Verdict::kWeak);
  EXPECT_EQ(VerdictOfContraction(0.9), Verdict::kNotIdentified);
}

}  // namespace
}  // namespace polyest::internal
