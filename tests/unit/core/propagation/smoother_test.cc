// What all samples of a record tell of the states at an instant. The oracle conditions the joint
// normal distribution of all states of the record on all samples, in dense matrices.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "core/propagation/filter_bank.h"
#include "tests/unit/core/propagation/driven_oscillators.h"

namespace polyest::internal::smoother_test {
namespace {

constexpr double kStep = 0.05, kSigma = 0.02;
constexpr int kRows = 60;

// x is measured.
const std::vector<DrivenOscillator> kOscillators = {
    {40, 0.3, 1, 0, 0.01}, {36, 0.2, 0.5, 1, 0.1}, {42, 0.5, 0, 0, 1e-6}, {39, 0.1, 1, -1, 0}};

struct Record {
  std::vector<double> times_s;
  Matrix values, noise;  // of x and v; every fourth row has no sample, and v never has one
};

Record MakeRecord() {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  Record record{{}, Matrix::Zero(2, kRows), Matrix::Zero(2, kRows)};
  for (int k = 0; k < kRows; ++k) {
    record.times_s.push_back((k + 1) * kStep);
    record.values(0, k) = std::cos(6.3 * record.times_s.back()) + kSigma * normal(random);
    record.noise(0, k) = k % 4 == 3 ? 0 : kSigma;
  }
  return record;
}

struct Smoothed {
  Matrix mean, deviation;  // (x, v) × rows
};

// With x_k = Φ x_{k−1} + w_k the states deviate from their means by G w; given z = H x + e they are
// normal with mean X Hᵀ (H X Hᵀ + R)⁻¹ (z − H x̄) beyond x̄ and covariance X − X Hᵀ (…)⁻¹ H X, X = G
// Q Gᵀ.
Smoothed Exact(const DrivenOscillator& oscillator, const Record& record) {
  Eigen::Matrix2d A, q = Eigen::Matrix2d::Zero();
  A << 0, 1, -oscillator.k, -oscillator.c;
  q(1, 1) = oscillator.q;
  const Eigen::Matrix2d whole = (A * kStep).exp(), half = (A * kStep / 2).exp();
  const Eigen::Matrix2d noise =
      kStep / 6 * (whole * q * whole.transpose() + 4 * half * q * half.transpose() + q);
  Matrix G = Matrix::Zero(2 * kRows, 2 * kRows), Q = G, X;
  Vector mean(2 * kRows);
  Eigen::Vector2d state(oscillator.x0, oscillator.v0);
  for (int k = 0; k < kRows; ++k) {
    state = whole * state;
    mean.segment(2 * k, 2) = state;
    Q.block(2 * k, 2 * k, 2, 2) = noise;
    if (k > 0) G.middleRows(2 * k, 2) = whole * G.middleRows(2 * k - 2, 2);
    G.block(2 * k, 2 * k, 2, 2).setIdentity();
  }
  X = G * Q * G.transpose();
  std::vector<int> rows;
  for (int k = 0; k < kRows; ++k) {
    if (record.noise(0, k) > 0) rows.push_back(k);
  }
  const Eigen::Index samples = std::ssize(rows);
  Matrix H = Matrix::Zero(samples, 2 * kRows);
  Vector z(samples);
  for (Eigen::Index i = 0; i < samples; ++i) {
    H(i, 2 * rows[static_cast<size_t>(i)]) = 1;
    z[i] = record.values(0, rows[static_cast<size_t>(i)]);
  }
  const Matrix S = H * X * H.transpose() + kSigma * kSigma * Matrix::Identity(samples, samples);
  const Matrix gain = S.ldlt().solve(H * X).transpose();
  mean += gain * (z - H * mean);
  const Matrix P = X - gain * H * X;
  const Vector deviation = P.diagonal().cwiseMax(0).cwiseSqrt();
  return {mean.reshaped(2, kRows), deviation.reshaped(2, kRows)};
}

// Marks every `stride`-th row and compares there.
void ExpectExact(int stride) {
  const Record record = MakeRecord();
  Ensemble ensemble = DrivenOscillatorEnsemble(kOscillators, {"x", "v"});
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  bank.StartBackward();
  Matrix innovations(bank.members(), 2), log_variances = innovations;
  for (int k = 0; k < kRows; ++k) {
    const double t = record.times_s[static_cast<size_t>(k)];
    if (k % stride == 0) {
      ASSERT_TRUE(bank.Mark(t, Stop()).ok());
    }
    const FilterSamples samples{{&t, 1}, record.values.col(k), record.noise.col(k)};
    ASSERT_TRUE(bank.Advance(samples, innovations, log_variances, Stop()).ok());
  }
  bank.FinishBackward();
  std::vector<Smoothed> exact;
  for (const DrivenOscillator& oscillator : kOscillators)
    exact.push_back(Exact(oscillator, record));
  Matrix means(bank.members(), 2), deviations = means;
  for (int k = 0; k < kRows; k += stride) {
    const double time_s = record.times_s[static_cast<size_t>(k)];
    EXPECT_TRUE(bank.ReadMarked(static_cast<size_t>(k / stride), time_s, means, deviations).ok());
    for (size_t i = 0; i < kOscillators.size(); ++i) {
      for (int c = 0; c < 2; ++c) {
        const auto member = static_cast<Eigen::Index>(i);
        // The integrator's tolerance is 1e-10 of the states, which are below 10; the filter takes
        // in 45 samples of 1/kSigma each.
        const double tolerance = 1e-6 * exact[i].deviation(c, k) + 1e-7;
        EXPECT_NEAR(means(member, c), exact[i].mean(c, k), tolerance) << k << ' ' << i << ' ' << c;
        EXPECT_NEAR(deviations(member, c), exact[i].deviation(c, k), tolerance)
            << k << ' ' << i << ' ' << c;
      }
    }
  }
}

TEST(Smoother, IsTheConditionalDistributionOfALinearModel) { ExpectExact(1); }

TEST(Smoother, NeedsOnlyTheInstantsAskedFor) { ExpectExact(7); }

TEST(Smoother, IsTheFilterAfterTheLastSample) {
  const Record record = MakeRecord();
  Ensemble ensemble = DrivenOscillatorEnsemble(kOscillators, {"x", "v"});
  FilterBank smoother(ensemble.specification, &ensemble.inputs);
  FilterBank filter(ensemble.specification, &ensemble.inputs);
  smoother.StartBackward();
  Matrix innovations(filter.members(), 2 * kRows), log_variances = innovations;
  const FilterSamples samples{record.times_s, record.values, record.noise};
  ASSERT_TRUE(smoother.Advance(samples, innovations, log_variances, Stop()).ok());
  ASSERT_TRUE(filter.Advance(samples, innovations, log_variances, Stop()).ok());
  const double later_s = record.times_s.back() + 3 * kStep;
  ASSERT_TRUE(smoother.Mark(later_s, Stop()).ok());
  smoother.FinishBackward();
  Matrix means(filter.members(), 2), deviations = means, expected_means = means,
                                     expected_deviations = means;
  ASSERT_TRUE(filter.Predict(later_s, expected_means, expected_deviations, Stop()).ok());
  ASSERT_TRUE(smoother.ReadMarked(0, later_s, means, deviations).ok());
  EXPECT_EQ(means, expected_means);
  EXPECT_EQ(deviations, expected_deviations);
}

}  // namespace
}  // namespace polyest::internal::smoother_test
