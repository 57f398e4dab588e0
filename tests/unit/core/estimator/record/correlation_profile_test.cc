// Compares the likelihood of each time constant with that of the Gaussian whose covariance is
// written out, with the parameters integrated out in closed form.

#include "core/estimator/record/correlation_profile.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

namespace polyest::internal {
namespace {

constexpr int kUnknowns = 2;
constexpr TimeConstantGrid kGrid = {0.01, 3};

// Two runs of irregular samples of a linear model.
struct LinearRecord {
  LinearRecord() {
    const std::vector<double> times = {0.1, 0.11, 0.4, 0.9, 1.5, 0.2, 0.25, 1.1, 2.9};
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
  static constexpr Eigen::Index kSecondRun = 5;

  // The correlation of the noise of two samples.
  double Correlation(Eigen::Index i, Eigen::Index j, double time_constant_s) const {
    if (i == j) return 1;
    if ((i < kSecondRun) != (j < kSecondRun) || time_constant_s == 0) return 0;
    const double lag = time_s[static_cast<size_t>(i)] - time_s[static_cast<size_t>(j)];
    return std::exp(-std::abs(lag) / time_constant_s);
  }
  Matrix Covariance(double time_constant_s) const {
    return Matrix::NullaryExpr(residual.size(), residual.size(),
                               [&](auto i, auto j) { return Correlation(i, j, time_constant_s); });
  }

  std::vector<double> time_s;
  Matrix gradient;
  Vector residual;
};

// Adds the record, whitened with the time constant.
CorrelationProfile ProfileOf(const LinearRecord& record, double present_s) {
  CorrelationProfile profile(kGrid, present_s, kUnknowns);
  for (Eigen::Index k = 0; k < record.residual.size(); ++k) {
    if (k == LinearRecord::kSecondRun) profile.BeginRun();
    const double a = k > 0 ? record.Correlation(k, k - 1, present_s) : 0;
    Vector gradient = record.gradient.row(k);
    double residual = record.residual[k];
    if (a > 0) {
      gradient = (gradient - a * record.gradient.row(k - 1).transpose()) / std::sqrt(1 - a * a);
      residual = (residual - a * record.residual[k - 1]) / std::sqrt(1 - a * a);
    }
    profile.Add(record.time_s[static_cast<size_t>(k)], gradient, residual);
  }
  return profile;
}

// −log of the density of the residuals of a linear model with Gaussian parameters, N(0, 1), without
// ½ N log 2π: they have the covariance s² K + X Xᵀ.
double Exact(const LinearRecord& record, double time_constant_s, double scale) {
  const Matrix covariance = scale * scale * record.Covariance(time_constant_s) +
                            record.gradient * record.gradient.transpose();
  const Eigen::LLT<Matrix> factor(covariance);
  return 0.5 * record.residual.dot(factor.solve(record.residual)) +
         Matrix(factor.matrixL()).diagonal().array().log().sum();
}

TEST(CorrelationProfile, IsTheLikelihoodOfEveryTimeConstant) {
  const LinearRecord record;
  const auto samples = static_cast<double>(record.residual.size());
  for (const double present_s : {0.0, 0.5}) {
    const CorrelationProfile profile = ProfileOf(record, present_s);
    for (const CorrelationProfile::Member& member : profile.members()) {
      const double exact = Exact(record, member.time_constant_s, 1);
      const ProfileValue value =
          EvaluateMember(member, samples, Matrix::Identity(kUnknowns, kUnknowns), false);
      EXPECT_NEAR(value.negative_log_likelihood, exact, 1e-10) << member.time_constant_s;
      EXPECT_EQ(value.scale, 1);
    }
  }
}

TEST(CorrelationProfile, MaximizesTheLikelihoodOverAnUnknownScale) {
  const LinearRecord record;
  const auto samples = static_cast<double>(record.residual.size());
  const CorrelationProfile profile = ProfileOf(record, 0.5);
  for (const CorrelationProfile::Member& member : profile.members()) {
    const ProfileValue value =
        EvaluateMember(member, samples, Matrix::Identity(kUnknowns, kUnknowns), true);
    const double exact = Exact(record, member.time_constant_s, value.scale);
    EXPECT_NEAR(value.negative_log_likelihood, exact, 1e-10);
    // The scale maximizes the likelihood but for the part of the parameters that their prior fixes;
    // with λ/(λ + s²) ≈ 1 there is none.
    for (const double factor : {0.8, 1.25}) {
      EXPECT_GT(Exact(record, member.time_constant_s, factor * value.scale), exact - 0.02);
    }
  }
}

TEST(CorrelationProfile, HasAGridFromTheShortestToTheLongest) {
  EXPECT_DOUBLE_EQ(kGrid.At(0), kGrid.shortest_s);
  EXPECT_DOUBLE_EQ(kGrid.At(TimeConstantGrid::kSteps - 1), kGrid.longest_s);
  const CorrelationProfile profile(kGrid, 0.5, kUnknowns);
  EXPECT_EQ(profile.members()[CorrelationProfile::kPresent].time_constant_s, 0.5);
  EXPECT_EQ(profile.members()[CorrelationProfile::kWhite].time_constant_s, 0);
  EXPECT_TRUE(CorrelationProfile().empty());
}

}  // namespace
}  // namespace polyest::internal
