#include "core/estimator/studies/log_density.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::log_density_test {
namespace {

LogDensityOptions At(const Matrix& points, int derivative_order) {
  return {.points = points, .derivative_order = derivative_order};
}

// The oracle is a Gaussian posterior with precision P = I + h hᵀ/σ² about P m = h z/σ².
TEST(LogDensity, OfALinearProblemIsTheGaussianPosterior) {
  const double noise = 0.3, z = 1.5;
  const auto estimator = Processed(TextProblem("a + 2*b",
                                               {UncertainParameter::Normal("a", 0, 1).value(),
                                                UncertainParameter::Normal("b", 0, 1).value()},
                                               noise),
                                   {z});
  const Eigen::Vector2d h(1, 2);
  const Eigen::Matrix2d data = h * h.transpose() / (noise * noise);
  const Eigen::Matrix2d precision = Eigen::Matrix2d::Identity() + data;
  const Eigen::Vector2d map = precision.inverse() * h * z / (noise * noise);
  Matrix points(2, 2);
  points << map[0] + 0.1, map[1] - 0.05, map[0] - 0.2, map[1] + 0.12;
  const LogDensity density = estimator->CurrentLogDensity(At(points, 2)).value();
  EXPECT_EQ(density.parameters, (std::vector<std::string>{"a", "b"}));
  std::vector<double> offset, likelihood_offset;
  for (size_t k = 0; k < 2; ++k) {
    const Eigen::Vector2d theta = points.row(static_cast<Eigen::Index>(k)).transpose();
    const Eigen::Vector2d off = theta - map;
    const double residual = z - h.dot(theta);
    EXPECT_TRUE(density.posterior[k].gradient.isApprox(-precision * off, 1e-6));
    EXPECT_TRUE(density.posterior[k].hessian.isApprox(-precision, 1e-6));
    EXPECT_TRUE(density.likelihood[k].gradient.isApprox(h * residual / (noise * noise), 1e-6));
    EXPECT_TRUE(density.likelihood[k].hessian.isApprox(-data, 1e-6));
    offset.push_back(density.posterior[k].value + off.dot(precision * off) / 2);
    likelihood_offset.push_back(density.likelihood[k].value +
                                residual * residual / (2 * noise * noise));
  }
  EXPECT_NEAR(offset[0], offset[1], 1e-7);
  EXPECT_NEAR(likelihood_offset[0], likelihood_offset[1], 1e-7);
}

// Two uniform parameters with a normal copula, and a lognormal one: their density is
//   exp(−(ρ²(z_1² + z_2²) − 2 ρ z_1 z_2)/(2 (1 − ρ²))) · exp(−(log c)²/(2 s²))/c, up to a constant.
Problem CurvedProblem(double rho) {
  Problem problem = TextProblem("a*a + b + c + a*b*c",
                                {UncertainParameter::Uniform("a", 0, 1).value(),
                                 UncertainParameter::Uniform("b", 0, 1).value(),
                                 UncertainParameter::Lognormal("c", 1.1, 0.3).value()},
                                0.5);
  problem.correlations = {{"a", "b", rho}};
  return problem;
}

Matrix CurvedPoints() {
  Matrix points(3, 3);
  points << 0.5, 0.4, 1.0, 0.62, 0.45, 1.15, 0.4, 0.55, 0.9;
  return points;
}

TEST(LogDensity, DividesLikelihoodAndPriorOverTheParametersThemselves) {
  const double rho = 0.6;
  const auto estimator = Processed(CurvedProblem(rho), {2.2});
  const Matrix points = CurvedPoints();
  const LogDensity density = estimator->CurrentLogDensity(At(points, 0)).value();
  const double s2 = std::log(1 + 0.3 * 0.3 / (1.1 * 1.1)), middle = std::log(1.1) - s2 / 2;
  // The logarithm of N(0, 1)'s inverse of 0.5, 0.4 …, from tables of the normal distribution.
  const double quantile[3][2] = {{0, -0.2533471031357997},
                                 {0.3054807880993974, -0.12566134685507402},
                                 {-0.2533471031357997, 0.12566134685507402}};
  std::vector<double> offset;
  for (size_t k = 0; k < 3; ++k) {
    const double z1 = quantile[k][0], z2 = quantile[k][1];
    const double c = points(static_cast<Eigen::Index>(k), 2);
    const double copula =
        -(rho * rho * (z1 * z1 + z2 * z2) - 2 * rho * z1 * z2) / (2 * (1 - rho * rho));
    const double log_c = std::log(c) - middle;
    const double prior = copula - log_c * log_c / (2 * s2) - std::log(c);
    offset.push_back(density.posterior[k].value - density.likelihood[k].value - prior);
  }
  EXPECT_NEAR(offset[0], offset[1], 1e-9);
  EXPECT_NEAR(offset[0], offset[2], 1e-9);
}

// Central differences of step h err by about h² |f‴|/6 for a first derivative and by ε |f|/h for
// rounding: with h = 1e-4 and derivatives of the order of 100, below 1e-5.
TEST(LogDensity, HasTheDerivativesThatDifferencesHave) {
  const double h = 1e-4, tolerance = 1e-5;
  const auto estimator = Processed(CurvedProblem(0.6), {2.2});
  const Matrix points = CurvedPoints();
  const LogDensity density = estimator->CurrentLogDensity(At(points, 2)).value();
  for (Eigen::Index k = 0; k < points.rows(); ++k) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      Matrix two(2, 3);
      two.row(0) = two.row(1) = points.row(k);
      two(0, i) += h;
      two(1, i) -= h;
      const LogDensity near = estimator->CurrentLogDensity(At(two, 1)).value();
      for (const auto of : {&LogDensity::posterior, &LogDensity::likelihood}) {
        const LogDensityValue& here = (density.*of)[static_cast<size_t>(k)];
        const LogDensityValue &up = (near.*of)[0], &down = (near.*of)[1];
        EXPECT_NEAR(here.gradient[i], (up.value - down.value) / (2 * h), tolerance);
        const Vector difference = (up.gradient - down.gradient) / (2 * h);
        EXPECT_LT((here.hessian.col(i) - difference).cwiseAbs().maxCoeff(), tolerance);
      }
    }
  }
}

TEST(LogDensity, RefusesPointsWithoutOneAndForgetsNothingOlderSamplesSaid) {
  const auto estimator = Processed(CurvedProblem(0), {2.2});
  Matrix outside(1, 3);
  outside << 0.5, 1.5, 1;
  EXPECT_EQ(estimator->CurrentLogDensity(At(outside, 0)).status().message(),
            "values: point 1 (a = 0.5, b = 1.5, c = 1) lies outside of the prior's support");
  outside(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(estimator->CurrentLogDensity(At(outside, 0)).ok());
  EXPECT_EQ(estimator->CurrentLogDensity(At(Matrix::Zero(1, 2), 0)).status().message(),
            "values: points need 3 values each: a, b, c");
  EXPECT_FALSE(estimator->CurrentLogDensity(At(CurvedPoints(), 3)).ok());
  // Later samples count.
  const Matrix point = CurvedPoints().topRows(1);
  const double one = estimator->CurrentLogDensity(At(point, 2)).value().likelihood[0].hessian(2, 2);
  Samples more;
  more.time_s = {2, 3, 4};
  more.columns = {{"y", {2.2, 2.2, 2.2}, {}}};
  ASSERT_TRUE(estimator->Append(more).ok());
  ASSERT_TRUE(estimator->Process().ok());
  const double four =
      estimator->CurrentLogDensity(At(point, 2)).value().likelihood[0].hessian(2, 2);
  EXPECT_NEAR(four, 4 * one, 1e-6 * std::abs(four));
}

}  // namespace
}  // namespace polyest::internal::log_density_test
