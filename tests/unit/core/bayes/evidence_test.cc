#include "core/bayes/evidence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/chaos/collocation_points.h"

namespace polyest::internal {
namespace {

// Returns quasi-random standard normal points.
Matrix NormalPoints(int dimension, int count) {
  const std::vector<Germ> germs(static_cast<size_t>(dimension), Germ::Normal());
  return CollocationPoints(PointSet::kHalton, germs, 0, count).value();
}

Vector Equal(int count) { return Vector::Constant(count, 1.0 / count); }

TEST(LogEvidence, OfAGaussianIsItsNormalization) {
  for (const int n : {1, 3, 8}) {
    const Matrix draws = 1e-3 * NormalPoints(n, 20'000);
    const LogDensity density = [](const Matrix& points, Vector& values) {
      values = 40 - 0.5e6 * points.rowwise().squaredNorm().array();
    };
    // The oracle is log ∫ e^{40 − r²/2s²} = 40 + n/2 log 2π + n log s
    const double exact = 40 + n * (0.5 * std::log(2 * std::numbers::pi) + std::log(1e-3));
    EXPECT_NEAR(LogEvidence(density, draws, Equal(20'000)), exact, 0.01) << n;
  }
}

// The density is e^{−x} on x > 0, so that log Z = 0. Half of the points of the Gaussian beside it
// lie where the density is zero.
TEST(LogEvidence, OfADensityAtABoundIsExact) {
  const Vector u = UnitCubePoints(PointSet::kHalton, 1, 20'000);
  const Matrix draws = -(1 - u.array()).log().matrix();
  const LogDensity density = [](const Matrix& points, Vector& values) {
    values = points.col(0).unaryExpr([](double x) { return x > 0 ? -x : -kInfinity; });
  };
  EXPECT_NEAR(LogEvidence(density, draws, Equal(20'000)), 0, 0.01);
}

TEST(LogEvidence, OfWeightedDrawsIsThatOfTheirDensity) {
  // The draws have twice the width and are weighted to the standard normal.
  const Matrix draws = 2 * NormalPoints(1, 20'000);
  Vector weights = (-0.5 * draws.col(0).array().square() * (1 - 0.25)).exp();
  weights /= weights.sum();
  const LogDensity density = [](const Matrix& points, Vector& values) {
    values = -0.5 * points.rowwise().squaredNorm();
  };
  EXPECT_NEAR(LogEvidence(density, draws, weights), 0.5 * std::log(2 * std::numbers::pi), 0.01);
}

TEST(LogEvidence, OfDrawsThatDoNotSpreadIsNone) {
  const LogDensity density = [](const Matrix& points, Vector& values) {
    values = Vector::Zero(points.rows());
  };
  EXPECT_EQ(LogEvidence(density, Matrix::Zero(10, 2), Equal(10)), -kInfinity);
}

}  // namespace
}  // namespace polyest::internal
