#include <absl/status/status.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "core/chaos/collocation_matrix.h"
#include "core/chaos/collocation_points.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

TEST(CollocationPoints, HaltonStartsWithTheKnownRadicalInverses) {
  const Matrix points = UnitCubePoints(PointSet::kHalton, 3, 4);
  Matrix expected(4, 3);
  expected << 1. / 2, 1. / 3, 1. / 5, 1. / 4, 2. / 3, 2. / 5, 3. / 4, 1. / 9, 3. / 5, 1. / 8,
      4. / 9, 4. / 5;
  EXPECT_TRUE(points.isApprox(expected, 1e-15));
}

TEST(CollocationPoints, HaltonPermutesTheDigitsInLargePrimes) {
  // Faure's permutation of base 7 is 0 2 5 3 1 4 6.
  const Matrix points = UnitCubePoints(PointSet::kHalton, 4, 6);
  const Vector expected = Vector{{2, 5, 3, 1, 4, 6}} / 7;
  EXPECT_TRUE(points.col(3).isApprox(expected, 1e-15));
}

TEST(CollocationPoints, EveryCoordinateIsEvenlySpreadInsideTheOpenCube) {
  for (const PointSet set : {PointSet::kHalton, PointSet::kHammersley}) {
    const Matrix points = UnitCubePoints(set, 15, 500);
    EXPECT_GT(points.minCoeff(), 0);
    EXPECT_LT(points.maxCoeff(), 1);
    for (int k = 0; k < 15; ++k) {
      std::set<double> distinct(points.col(k).begin(), points.col(k).end());
      EXPECT_EQ(distinct.size(), 500u);
      // Each interval [i/b, (i+1)/b) receives 500/b of 500 consecutive radical inverses in base b,
      // to within one. The mean is then ½ to within b/500, and b ≤ 47.
      EXPECT_NEAR(points.col(k).mean(), 0.5, 47. / 500) << k;
    }
  }
}

TEST(CollocationPoints, HammersleyLeadsWithTheRegularGrid) {
  const Matrix points = UnitCubePoints(PointSet::kHammersley, 2, 4);
  EXPECT_TRUE(points.col(0).isApprox(Vector{{0.125, 0.375, 0.625, 0.875}}, 1e-15));
  EXPECT_TRUE(points.col(1).isApprox(Vector{{0.5, 0.25, 0.75, 0.125}}, 1e-15));
}

TEST(CollocationPoints, PassThroughTheQuantilesOfTheGerms) {
  const std::vector<Germ> germs = {Germ::Normal(), Germ::Gamma(1)};
  const Matrix points = CollocationPoints(PointSet::kHalton, germs, 2, 12).value();
  const Matrix unit = UnitCubePoints(PointSet::kHalton, 2, 12);
  for (int q = 0; q < 12; ++q) {
    EXPECT_NEAR(0.5 * std::erfc(-points(q, 0) / std::sqrt(2)), unit(q, 0), 1e-14);
    EXPECT_NEAR(-std::expm1(-points(q, 1)), unit(q, 1), 1e-14);
  }
}

TEST(CollocationPoints, GaussTensorHoldsEveryCombinationOfNodes) {
  const std::vector<Germ> germs(3, Germ::Uniform());
  const Matrix points = CollocationPoints(PointSet::kGaussTensor, germs, 1, 0).value();
  ASSERT_EQ(points.rows(), 8);
  const double node = 1 / std::sqrt(3);
  EXPECT_TRUE(points.cwiseAbs().isApproxToConstant(node, 1e-14));
  std::set<std::vector<bool>> signs;
  for (int q = 0; q < 8; ++q) {
    signs.insert({points(q, 0) > 0, points(q, 1) > 0, points(q, 2) > 0});
  }
  EXPECT_EQ(signs.size(), 8u);
}

TEST(CollocationPoints, AGridTooLargeIsRefusedWithItsSize) {
  const std::vector<Germ> germs(12, Germ::Uniform());
  const auto points = CollocationPoints(PointSet::kGaussTensor, germs, 3, 0);
  EXPECT_EQ(points.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(points.status().message(), HasSubstr("4^12 points, more than the limit 100000"));
}

struct Case {
  int dimension, order, points;
  double measured;  // the condition number
};

TEST(CollocationMatrix, OfHaltonPointsIsWellConditioned) {
  // The measured values are 5.2, 3.2, 6.1, 4.3 and 5.3; plain Halton points give 67.7 in the last
  // case.
  for (const Case& c : {Case{2, 3, 20, 5.2}, Case{5, 2, 42, 3.2}, Case{5, 3, 112, 6.1},
                        Case{6, 2, 56, 4.3}, Case{12, 2, 182, 5.3}}) {
    const std::vector<Germ> germs(static_cast<size_t>(c.dimension), Germ::Uniform());
    const Basis basis(germs, c.order);
    const Matrix points = CollocationPoints(PointSet::kHalton, germs, c.order, c.points).value();
    const auto matrix = CollocationMatrix::Factor(basis, points);
    ASSERT_TRUE(matrix.ok()) << matrix.status();
    EXPECT_NEAR(matrix->condition(), c.measured, 0.06) << c.dimension << ", " << c.order;
  }
}

// As many independent random points have about 5.5. With Faure's permutations alone it is 700 and
// more: the bases of the last dimensions exceed the number of points.
TEST(CollocationMatrix, OfManyParametersIsWellConditioned) {
  for (const int n : {26, 40, 64}) {
    const std::vector<Germ> germs(static_cast<size_t>(n), Germ::Uniform());
    const Matrix points = CollocationPoints(PointSet::kHalton, germs, 1, 2 * (n + 1)).value();
    const auto matrix = CollocationMatrix::Factor(Basis(germs, 1), points);
    ASSERT_TRUE(matrix.ok()) << matrix.status();
    EXPECT_LT(matrix->condition(), 7) << n;
  }
}

TEST(CollocationMatrix, ConditionIsTheRatioOfSingularValues) {
  // The points are ±1 and the basis is 1, √3 ξ, so that the columns are orthogonal with lengths √2
  // and √6.
  const Basis basis({Germ::Uniform()}, 1);
  const auto matrix = CollocationMatrix::Factor(basis, Vector{{-1, 1}});
  ASSERT_TRUE(matrix.ok());
  EXPECT_NEAR(matrix->condition(), std::sqrt(3), 1e-14);
}

TEST(CollocationMatrix, RecoversPolynomialsExactly) {
  const std::vector<Germ> germs = {Germ::Normal(), Germ::Uniform(), Germ::Beta(2, 2),
                                   Germ::Gamma(2)};
  const Basis basis(germs, 3);
  const Matrix points = CollocationPoints(PointSet::kHalton, germs, 3, 2 * basis.size()).value();
  auto matrix = CollocationMatrix::Factor(basis, points);
  ASSERT_TRUE(matrix.ok()) << matrix.status();
  Matrix expected(basis.size(), 2);
  for (int s = 0; s < basis.size(); ++s) expected.row(s) << std::cos(s), 1.0 / (s + 1);
  Matrix coefficients(basis.size(), 2);
  Vector variance(2);
  matrix->Solve(matrix->matrix() * expected, coefficients, variance);
  // The solution is backward stable: the error is the condition number (some 100 here) times
  // rounding.
  EXPECT_LT((coefficients - expected).lpNorm<Eigen::Infinity>(), 1e-12);
  EXPECT_LT(variance.maxCoeff(), 1e-24);
}

TEST(CollocationMatrix, ResidualVarianceOfAConstantIsTheSampleVariance) {
  const Basis basis({Germ::Uniform()}, 0);
  auto matrix = CollocationMatrix::Factor(basis, Vector{{-0.5, 0, 0.2, 0.5}});
  ASSERT_TRUE(matrix.ok());
  Matrix coefficients(1, 1);
  Vector variance(1);
  matrix->Solve(Vector{{1, 2, 3, 6}}, coefficients, variance);
  EXPECT_NEAR(coefficients(0, 0), 3, 1e-14);
  EXPECT_NEAR(variance[0], 14.0 / 3, 1e-13);  // (4 + 1 + 0 + 9)/3
}

TEST(CollocationMatrix, InterpolationShowsNoResidual) {
  const Basis basis({Germ::Uniform()}, 2);
  auto matrix = CollocationMatrix::Factor(basis, Vector{{-0.7, 0.1, 0.8}});
  ASSERT_TRUE(matrix.ok());
  Matrix coefficients(3, 1);
  Vector variance = Vector::Constant(1, 7);
  matrix->Solve(Vector{{1, -1, 5}}, coefficients, variance);
  EXPECT_EQ(variance[0], 0);
  EXPECT_TRUE((matrix->matrix() * coefficients).isApprox(Vector{{1, -1, 5}}, 1e-14));
}

TEST(CollocationMatrix, PointsAtWhichTheBasisOverflowsAreRefused) {
  // The singular values are found in different ways for few terms and for many.
  for (const int order : {3, 30}) {
    const Basis basis({Germ::Normal()}, order);
    const Vector points = 1e150 * Vector::LinSpaced(2 * basis.size(), -1, 1);
    const auto matrix = CollocationMatrix::Factor(basis, points);
    EXPECT_EQ(matrix.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(matrix.status().message(), HasSubstr("(rank 0, condition number inf,"));
  }
}

TEST(CollocationMatrix, RepeatedPointsAreRefusedWithOrderTermsAndPoints) {
  const Basis basis({Germ::Uniform(), Germ::Uniform()}, 3);
  Matrix points = UnitCubePoints(PointSet::kHalton, 2, 20);
  for (int q = 9; q < 20; ++q) points.row(q) = points.row(q - 9);
  const auto matrix = CollocationMatrix::Factor(basis, points);
  EXPECT_EQ(matrix.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(matrix.status().message(),
              HasSubstr("20 points do not determine the 10 terms of order 3 (rank 9, condition"));
}

TEST(CollocationMatrix, TooFewPointsAreRefused) {
  const Basis basis({Germ::Uniform(), Germ::Uniform()}, 3);
  const auto matrix = CollocationMatrix::Factor(basis, UnitCubePoints(PointSet::kHalton, 2, 9));
  EXPECT_EQ(matrix.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(matrix.status().message(),
              HasSubstr("order 3 has 10 terms and needs at least as many points, not 9"));
}

TEST(CollocationMatrix, AConditionNumberPastTheLimitIsRefused) {
  const Basis basis({Germ::Uniform()}, 1);
  const Matrix close = Vector{{0.3, 0.3 + 1e-5, 0.3 - 1e-5}};
  EXPECT_TRUE(CollocationMatrix::Factor(basis, close, {}, 1e8).ok());
  const auto refused = CollocationMatrix::Factor(basis, close, {}, 1e4);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(refused.status().message(), HasSubstr("at most 1e+04 allowed"));
}

}  // namespace
}  // namespace polyest::internal
