#include "core/bayes/domain_cover.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/chaos/collocation_points.h"
#include "tests/unit/core/bayes/many_parameters.h"

namespace polyest::internal {
namespace {

constexpr double kOvershoot = 1.15;

// Expects each point in the box and in Ω.
void ExpectInside(const Matrix& cover, const Region& region, const Prior& prior, double half) {
  EXPECT_LE(cover.cwiseAbs().maxCoeff(), half);
  for (Eigen::Index i = 0; i < cover.rows(); ++i) {
    EXPECT_TRUE(prior.Contains(region.ToGerm(cover.row(i).transpose()))) << i;
  }
}

// The mean of an even cover of [−1, 1] is 0, its standard deviation 1/√3.
TEST(CoverOfDomain, IsEvenOverOmegaWhereTheBoxReachesBeyond) {
  const int n = 64;
  const Vector half = Vector::Constant(n, kOvershoot);
  const Region region = Region::WholePrior(n);
  const Matrix cover = CoverOfDomain(region, ManyUniforms(n), -half, half, Matrix(0, n), 2000);
  ExpectInside(cover, region, ManyUniforms(n), kOvershoot);
  for (int j = 0; j < n; ++j) {
    EXPECT_NEAR(cover.col(j).mean(), 0, 0.03);
    EXPECT_NEAR(std::sqrt(cover.col(j).squaredNorm() / 2000), 1 / std::sqrt(3.0), 0.02);
  }
}

// The box is rotated and lies about a corner of Ω, where a guess is.
TEST(CoverOfDomain, LiesInOmegaWhereTheBoxIsAboutACorner) {
  const int n = 40;
  const Matrix axes = 0.1 * OrthonormalBasisFrom(Vector::LinSpaced(n, 1, 2));
  const Region region(Vector::Constant(n, 0.97), axes);
  const Vector half = Vector::Constant(n, kOvershoot);
  const Matrix guess = region.ToLocal(Vector::Constant(n, 0.96)).transpose();
  const Matrix cover = CoverOfDomain(region, ManyUniforms(n), -half, half, guess, 500);
  ExpectInside(cover, region, ManyUniforms(n), kOvershoot);
  // They spread in all directions.
  const Matrix germs = region.ManyToGerm(cover);
  const Matrix centred = germs.rowwise() - germs.colwise().mean();
  const Vector spread = SymmetricEigenvalues(centred.transpose() * centred);
  EXPECT_GT(spread.minCoeff(), 0.1 * spread.maxCoeff());
}

TEST(CoverOfDomain, IsTheBoxWhereTheParametersHaveNoBounds) {
  const int n = 3;
  const Vector lower = Vector::Constant(n, -2), upper = Vector::Constant(n, 5);
  const Region region(Vector::Constant(n, 1), OrthonormalBasisFrom(Vector::Ones(n)));
  const Matrix cover = CoverOfDomain(region, ManyNormals(n), lower, upper, Matrix(0, n), 100);
  const Matrix unit = UnitCubePoints(PointSet::kHalton, n, 100);
  EXPECT_TRUE(cover.isApprox(Matrix((7 * unit.array() - 2).matrix()), 1e-14));
}

// Without a guess inside, the points are moved towards the place in Ω that is nearest to the box.
TEST(CoverOfDomain, NeedsNoGuess) {
  const int n = 2;
  const Region region(Vector::Constant(n, 1.0), OrthonormalBasisFrom(Vector::Ones(n)));
  const Vector half = Vector::Constant(n, kOvershoot);
  const Matrix cover = CoverOfDomain(region, ManyUniforms(n), -half, half, Matrix(0, n), 200);
  ExpectInside(cover, region, ManyUniforms(n), kOvershoot);
}

}  // namespace
}  // namespace polyest::internal
