#include "core/bayes/importance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "core/bayes/weighted_samples.h"
#include "tests/unit/core/bayes/many_parameters.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal {
namespace {

Prior Normals(int n) {
  std::vector<UncertainParameter> parameters;
  for (int i = 0; i < n; ++i) {
    parameters.push_back(
        UncertainParameter::Normal(std::string(1, static_cast<char>('a' + i)), 0, 1).value());
  }
  return Prior(parameters);
}

WeightedDraws Sample(const Cost& cost, const Vector& minimum, double bound, int points = 16'384) {
  const Eigen::LLT<Matrix> cholesky(cost.Hessian(minimum));
  const int n = cost.dimension();
  return ImportanceSample(cost, Vector::Constant(n, -bound), Vector::Constant(n, bound), minimum,
                          Matrix(cholesky.matrixL()), points);
}

// The posterior is, in closed form, the Gaussian of precision I + aaᵀ/σ². The error of the
// quasi-random points is far below that of as many random ones, 1/√16384 = 0.8 %.
TEST(ImportanceSample, HasTheMomentsAndQuantilesOfAGaussian) {
  const Eigen::Vector2d a(1, 2);
  const double z = 1.5, noise = 0.3;
  const Cost cost = CostOf(Normals(2), {{[&](const Vector& xi) { return a.dot(xi); }, z, noise}});
  const Eigen::Matrix2d covariance =
      (Eigen::Matrix2d::Identity() + a * a.transpose() / (noise * noise)).inverse();
  const Eigen::Vector2d mean = covariance * a * z / (noise * noise);
  const WeightedDraws draws = Sample(cost, mean, 10);
  EXPECT_NEAR(draws.weights.sum(), 1, 1e-12);
  for (int i = 0; i < 2; ++i) {
    const double sd = std::sqrt(covariance(i, i));
    EXPECT_NEAR(WeightedMean(draws.etas.col(i), draws.weights), mean[i], 0.002 * sd);
    EXPECT_NEAR(WeightedStandardDeviation(draws.etas.col(i), draws.weights) / sd, 1, 0.003);
    const WeightedQuantiles quantile(draws.etas.col(i), draws.weights);
    EXPECT_NEAR(quantile(0.975), mean[i] + 1.959963984540054 * sd, 0.01 * sd);
    EXPECT_NEAR(quantile(0.025), mean[i] - 1.959963984540054 * sd, 0.01 * sd);
  }
}

// The oracle is Σ w² N = ∫p²/q for the Gaussian p and the mixture q of two wider Gaussians. It is
// below that of the first alone: (s²/√(2s² − 1))ⁿ/0.85.
TEST(ImportanceSample, KeepsMostOfItsPointsOnAGaussian) {
  for (const int n : {1, 3, 6}) {
    const Cost cost = CostOf(Normals(n), {});
    const double spent = std::pow(1.21 / std::sqrt(2 * 1.21 - 1), n) / 0.85;
    EXPECT_GT(Sample(cost, Vector::Zero(n), 20).effective_size, 0.97 * 16'384 / spent) << n;
  }
}

// The data z_i of noise 1 and the prior N(0, 1) leave N(z_i/2, 1/2). With the scale 1.1 in all
// dimensions 0.85/2.66 of the points would be left.
TEST(ImportanceSample, KeepsMostOfItsPointsInManyDimensions) {
  const int n = 64;
  const Vector z = Vector::LinSpaced(n, -2, 2);
  const WeightedDraws draws = Sample(CostOfEach(ManyNormals(n), z, 1), z / 2, 20);
  EXPECT_GT(draws.effective_size, 0.6 * 16'384);
  for (int i = 0; i < n; ++i) {
    const double sd = std::sqrt(0.5);
    // Four standard errors of as many random draws as the effective size.
    EXPECT_NEAR(WeightedMean(draws.etas.col(i), draws.weights), z[i] / 2, 0.04 * sd);
    EXPECT_NEAR(WeightedStandardDeviation(draws.etas.col(i), draws.weights) / sd, 1, 0.03);
  }
}

// The box cuts off half of the Gaussian: half of the points are left, and the mean is √(2/π).
TEST(ImportanceSample, CountsNothingOutsideOfTheBox) {
  const Cost cost = CostOf(Normals(1), {});
  const WeightedDraws draws = ImportanceSample(cost, Vector::Zero(1), Vector::Constant(1, 20),
                                               Vector::Zero(1), Matrix::Identity(1, 1), 16'384);
  EXPECT_GE(draws.etas.minCoeff(), 0);
  EXPECT_LT(draws.effective_size, 0.5 * 16'384);
  EXPECT_NEAR(WeightedMean(draws.etas.col(0), draws.weights), std::sqrt(2 / M_PI), 0.002);
}

TEST(ImportanceSample, HasNoDrawsWhereThereIsNoDensity) {
  const Cost cost = CostOf(Normals(1), {});
  const WeightedDraws draws =
      ImportanceSample(cost, Vector::Constant(1, 100), Vector::Constant(1, 101), Vector::Zero(1),
                       Matrix::Identity(1, 1), 1000);
  EXPECT_EQ(draws.effective_size, 0);
  EXPECT_EQ(draws.etas.rows(), 0);
}

// The data measure b − a². The proposal is a wide Gaussian about one minimum, while the posterior
// is twice as narrow as the curvature says.
TEST(ImportanceSample, LosesItsEffectiveSizeWhereThePosteriorIsNotGaussian) {
  const Cost cost =
      CostOf(Normals(2), {{[](const Vector& xi) { return xi[1] - xi[0] * xi[0]; }, 0, 0.05}});
  EXPECT_LT(Sample(cost, Vector::Zero(2), 20).effective_size, 0.2 * 16'384);
}

}  // namespace
}  // namespace polyest::internal
