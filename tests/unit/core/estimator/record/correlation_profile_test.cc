// Compares the likelihood of each noise with that of the Gaussian whose covariance is
// written out, with the parameters integrated out in closed form.

#include "core/estimator/record/correlation_profile.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

namespace polyest::internal::correlation_profile_test {
namespace {

constexpr int kUnknowns = 2;
constexpr TimeConstantGrid kGrid = {0.01, 3};

// Two runs of irregular samples of a linear model.
struct LinearRecord {
  LinearRecord() : LinearRecord({0.1, 0.11, 0.4, 0.9, 1.5, 0.2, 0.25, 1.1, 2.9}, 5) {}
  LinearRecord(const std::vector<double>& times, Eigen::Index second) : second_run(second) {
    const auto rows = static_cast<Eigen::Index>(times.size());
    time_s = times;
    gradient.resize(rows, kUnknowns);
    residual.resize(rows);
    for (Eigen::Index k = 0; k < rows; ++k) {
      const double t = times[static_cast<size_t>(k)];
      gradient.row(k) << 1, t;
      residual[k] = std::sin(5 * t) + 0.3 * t;
    }
  }

  // The correlation of the noise of two samples.
  double Correlation(Eigen::Index i, Eigen::Index j, const NoiseShape& noise) const {
    if (i == j) return 1;
    if ((i < second_run) != (j < second_run) || noise.time_constant_s == 0) return 0;
    const double lag = time_s[static_cast<size_t>(i)] - time_s[static_cast<size_t>(j)];
    return (1 - noise.white_share) * std::exp(-std::abs(lag) / noise.time_constant_s);
  }
  Matrix Covariance(const NoiseShape& noise) const {
    return Matrix::NullaryExpr(residual.size(), residual.size(),
                               [&](auto i, auto j) { return Correlation(i, j, noise); });
  }

  Eigen::Index second_run;
  std::vector<double> time_s;
  Matrix gradient;
  Vector residual;
};

// Adds the record, whitened with the inverse of the Cholesky factor of the noise's covariance.
CorrelationProfile ProfileOf(const LinearRecord& record, const NoiseShape& present) {
  CorrelationProfile profile(kGrid, present, kUnknowns);
  const Matrix factor = record.Covariance(present).llt().matrixL();
  const Matrix gradient = factor.triangularView<Eigen::Lower>().solve(record.gradient);
  const Vector residual = factor.triangularView<Eigen::Lower>().solve(record.residual);
  for (Eigen::Index k = 0; k < residual.size(); ++k) {
    if (k == record.second_run) profile.BeginRun();
    profile.Add(record.time_s[static_cast<size_t>(k)], gradient.row(k).transpose(), residual[k]);
  }
  return profile;
}

// −log of the density of the residuals of a linear model with Gaussian parameters, N(0, 1), without
// ½ N log 2π: they have the covariance s² K + X Xᵀ.
double Exact(const LinearRecord& record, const NoiseShape& noise, double scale) {
  const Matrix covariance =
      scale * scale * record.Covariance(noise) + record.gradient * record.gradient.transpose();
  const Eigen::LLT<Matrix> factor(covariance);
  return 0.5 * record.residual.dot(factor.solve(record.residual)) +
         Matrix(factor.matrixL()).diagonal().array().log().sum();
}

class CorrelationProfileOf : public ::testing::TestWithParam<NoiseShape> {};

TEST_P(CorrelationProfileOf, IsTheLikelihoodOfEveryNoise) {
  const LinearRecord record;
  const auto samples = static_cast<double>(record.residual.size());
  for (const CorrelationProfile::Member& member : ProfileOf(record, GetParam()).Members()) {
    const double exact = Exact(record, member.noise, 1);
    const ProfileValue value =
        EvaluateMember(member, samples, Matrix::Identity(kUnknowns, kUnknowns), false);
    EXPECT_NEAR(value.negative_log_likelihood, exact, 1e-9)
        << member.noise.time_constant_s << ' ' << member.noise.white_share;
    EXPECT_EQ(value.scale, 1);
  }
}

// The product of the innovations' variances is below 10⁻³⁰⁰ for the longer time constants.
TEST_P(CorrelationProfileOf, IsTheLikelihoodOfALongRecord) {
  std::vector<double> times;
  for (int k = 1; k <= 200; ++k) times.push_back(4e-4 * k);
  const LinearRecord record(times, 150);
  for (const CorrelationProfile::Member& member : ProfileOf(record, GetParam()).Members()) {
    const double exact = Exact(record, member.noise, 1);
    const ProfileValue value =
        EvaluateMember(member, 200, Matrix::Identity(kUnknowns, kUnknowns), false);
    EXPECT_NEAR(value.negative_log_likelihood, exact, 1e-9 * (1 + std::abs(exact)))
        << member.noise.time_constant_s << ' ' << member.noise.white_share;
  }
}

TEST_P(CorrelationProfileOf, MaximizesTheLikelihoodOverAnUnknownScale) {
  const LinearRecord record;
  const auto samples = static_cast<double>(record.residual.size());
  for (const CorrelationProfile::Member& member : ProfileOf(record, GetParam()).Members()) {
    const ProfileValue value =
        EvaluateMember(member, samples, Matrix::Identity(kUnknowns, kUnknowns), true);
    const double exact = Exact(record, member.noise, value.scale);
    EXPECT_NEAR(value.negative_log_likelihood, exact, 1e-9);
    // The scale maximizes the likelihood but for the part of the parameters that their prior fixes;
    // with λ/(λ + s²) ≈ 1 there is none.
    for (const double factor : {0.8, 1.25}) {
      EXPECT_GT(Exact(record, member.noise, factor * value.scale), exact - 0.02);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(WhitenedRows, CorrelationProfileOf,
                         ::testing::Values(NoiseShape{}, NoiseShape{0.5, 0}, NoiseShape{0.5, 0.3},
                                           NoiseShape{0.5, 0.97}));

TEST(CorrelationProfile, HasAGridFromTheShortestToTheLongest) {
  EXPECT_DOUBLE_EQ(kGrid.At(0), kGrid.shortest_s);
  EXPECT_DOUBLE_EQ(kGrid.At(TimeConstantGrid::kSteps - 1), kGrid.longest_s);
  const NoiseShape present = {0.5, 0.3};
  const CorrelationProfile profile(kGrid, present, kUnknowns);
  EXPECT_EQ(profile.shapes()[CorrelationProfile::kPresent], present);
  EXPECT_EQ(profile.shapes()[CorrelationProfile::kWhite], NoiseShape());
  EXPECT_EQ(profile.shapes()[CorrelationProfile::kFirstOfGrid], (NoiseShape{kGrid.At(0), 0}));
  EXPECT_GT(profile.shapes()[CorrelationProfile::kFirstMixed].white_share, 0);
  EXPECT_TRUE(profile.HasNeighbours());
  EXPECT_FALSE(CorrelationProfile(kGrid, {0.5, 0}, kUnknowns).HasNeighbours());
  const NoiseShape& middle = profile.shapes()[CorrelationProfile::kFirstNeighbour + 4];
  EXPECT_NEAR(middle.time_constant_s, 0.5, 1e-15);
  EXPECT_NEAR(middle.white_share, 0.3, 1e-15);
  EXPECT_TRUE(CorrelationProfile().empty());
}

TEST(CorrelationProfile, HasSharesOverTheRangeInWhichBothPartsAreSeen) {
  const double interval_s = kGrid.shortest_s / TimeConstantGrid::kShortestInIntervals;
  for (const double time_constant_s : {interval_s, 30 * interval_s}) {
    const double n = time_constant_s / interval_s;
    double before = 0;
    for (int index = 0; index < TimeConstantGrid::kShares; ++index) {
      const double share = kGrid.ShareAt(time_constant_s, index);
      EXPECT_GT(share, before);
      before = share;
    }
    const double first = kGrid.ShareAt(time_constant_s, 0);
    EXPECT_LT(first / (1 - first), 1 / (2 * n));
    EXPECT_GT(before / (1 - before), 2 * n);
    EXPECT_NEAR(first, 1 - before, 1e-12);
  }
}

TEST(CorrelationProfile, StepsInTheLogarithms) {
  const NoiseShape noise = {2, 0.5};
  const NoiseShape neighbour = Neighbour(noise, 2, -1);
  EXPECT_NEAR(std::log(neighbour.time_constant_s / 2), 2 * kStepOfTimeConstant, 1e-14);
  EXPECT_NEAR(std::log(neighbour.white_share / (1 - neighbour.white_share)), -kStepOfShare, 1e-14);
}

// The variogram f + (1 − f)(1 − e^(−h/τ)), in units of the white noise, is 1 + h (1 − f)/(f τ) at
// short times h.
TEST(CorrelationProfile, HasNoisesThatAreAlikeOverShortTimes) {
  const NoiseShape noise = {2, 0.3};
  for (const double factor : kLongTimeFactors) {
    const NoiseShape alike = AlikeOverShortTimes(noise, factor);
    EXPECT_NEAR(alike.time_constant_s, 2 * factor, 1e-14);
    EXPECT_NEAR((1 - alike.white_share) / (alike.white_share * alike.time_constant_s),
                0.7 / (0.3 * 2), 1e-14);
  }
}

}  // namespace
}  // namespace polyest::internal::correlation_profile_test
