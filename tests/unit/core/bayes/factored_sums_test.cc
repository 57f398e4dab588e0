#include "core/bayes/factored_sums.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace polyest::internal {
namespace {

// Returns the sums of random samples whose coefficients c_s fall as decay^s; the errors have the
// standard deviation `error`.
MismatchSums RandomSums(int terms, int samples, double decay, double error) {
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  MismatchSums sums(terms);
  Vector coefficients(terms);
  for (int k = 0; k < samples; ++k) {
    for (int s = 0; s < terms; ++s) coefficients[s] = std::pow(decay, s) * normal(generator);
    sums.Add(coefficients, error * normal(generator), 1);
  }
  return sums;
}

// Returns χ² at each row of `points`.
Vector ChiSquared(const FactoredSums& factored, const Matrix& points) {
  Matrix product;
  Vector values(points.rows());
  factored.ChiSquaredMany(points, product, values);
  return values;
}

TEST(FactoredSums, HaveTheChiSquaredOfTheSums) {
  const MismatchSums sums = RandomSums(12, 100, 1, 1);
  const FactoredSums factored(&sums, false);
  EXPECT_EQ(factored.rank(), 12);
  const Matrix points = Matrix::Random(5, 12);
  const Vector values = ChiSquared(factored, points);
  for (int i = 0; i < 5; ++i) {
    const double expected = sums.ChiSquared(points.row(i).transpose());
    EXPECT_NEAR(values[i], expected, 1e-12 * expected);
  }
}

TEST(FactoredSums, HaveAColumnPerSampleWhereSamplesAreFew) {
  const MismatchSums sums = RandomSums(60, 7, 1, 1);
  const FactoredSums factored(&sums, true);
  EXPECT_EQ(factored.rank(), 7);
  const Matrix points = Matrix::Random(5, 60);
  const Vector values = ChiSquared(factored, points);
  for (int i = 0; i < 5; ++i) {
    const double expected = sums.ChiSquared(points.row(i).transpose());
    EXPECT_NEAR(values[i], expected, 1e-12 * expected);
  }
}

// With d = e_i, what the factor lacks is entry i of the diagonal of the rest. The entries are ≥ 0
// and their sum is the trace.
TEST(FactoredSums, LeaveOutATraceThatIsNegligible) {
  constexpr int kTerms = 30;
  const MismatchSums sums = RandomSums(kTerms, 1000, 0.3, 1);
  const FactoredSums factored(&sums, false);
  EXPECT_LT(factored.rank(), 15);
  const Vector values = ChiSquared(factored, Matrix::Identity(kTerms, kTerms));
  double trace = 0;
  for (int s = 0; s < kTerms; ++s) {
    const double lack = sums.ChiSquared(Vector::Unit(kTerms, s)) - values[s];
    EXPECT_GT(lack, -1e-12 * sums.w());
    trace += lack;
  }
  EXPECT_LT(trace, 1e-6 + kTerms * 1e-12 * sums.w());
  EXPECT_GT(trace, 1e-9);  // something was left out
}

// χ² is 10⁻¹⁰ N at its least. There a likelihood of unknown scale changes by ½ N log of the ratio,
// so χ² must be known relatively.
TEST(FactoredSums, KeepWhatMattersRelativeToTheResiduals) {
  constexpr int kTerms = 30, kSamples = 1000;
  const MismatchSums sums = RandomSums(kTerms, kSamples, 0.3, 1e-5);
  const FactoredSums absolute(&sums, false), relative(&sums, true);
  EXPECT_GT(relative.rank(), absolute.rank() + 5);
  const Matrix point = Matrix::Constant(1, kTerms, 1e-5);
  const double expected = sums.ChiSquared(point.row(0).transpose());
  EXPECT_NEAR(ChiSquared(relative, point)[0] / expected, 1, 1e-6);
}

// Single points are evaluated through the factor where it has few columns, else through G; either
// way by what the sums themselves say, the gradient of which is 2 (G d − b).
TEST(FactoredSums, HaveTheValuesOfTheSumsAtSinglePoints) {
  constexpr int kTerms = 120;
  for (const int samples : {20, 300}) {
    const MismatchSums sums = RandomSums(kTerms, samples, 1, 1);
    const FactoredSums factored(&sums, true);
    EXPECT_EQ(factored.rank(), std::min(samples, kTerms));
    const Vector d = Vector::Random(kTerms);
    Vector gradient(kTerms), expected_gradient(kTerms);
    const double expected = sums.ChiSquaredWithGradient(d, expected_gradient);
    EXPECT_NEAR(factored.ChiSquared(d), expected, 1e-12 * expected);
    EXPECT_NEAR(factored.ChiSquaredWithGradient(d, gradient), expected, 1e-12 * expected);
    EXPECT_LT((gradient - expected_gradient).norm(), 1e-12 * expected_gradient.norm());
    const Matrix phi_gradient = Matrix::Random(kTerms, 3);
    const Matrix information = phi_gradient.transpose() * sums.G() * phi_gradient;
    EXPECT_LT((factored.Information(phi_gradient) - information).norm(),
              1e-12 * information.norm());
  }
}

TEST(FactoredSums, OfNoSamplesAreZero) {
  const MismatchSums sums(4);
  const FactoredSums factored(&sums, true);
  EXPECT_EQ(factored.rank(), 0);
  EXPECT_EQ(ChiSquared(factored, Matrix::Random(3, 4)), Vector::Zero(3));
}

}  // namespace
}  // namespace polyest::internal
