// Compares the whitening with the inverse of the Cholesky factor of the noise's covariance, which
// whitens any Gaussian noise. For this noise it must equal the whitening sample by sample.

#include "core/estimator/record/whitening.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <vector>

namespace polyest::internal::whitening_test {
namespace {

constexpr double kTimeConstant = 0.3;

// Holds one channel at irregular times, with a noise that changes and one sample missing.
struct Record {
  Record() {
    const double times[] = {0.1, 0.15, 0.4, 0.41, 1.0, 1.2};
    for (int k = 0; k < 6; ++k) {
      block.rows.push_back({0, times[k]});
      block.values.push_back(k == 2 ? std::numeric_limits<double>::quiet_NaN() : std::sin(3.0 * k));
      block.noise.push_back(k == 2 ? 0 : 0.1 * (k + 1));
    }
    outputs = Matrix::NullaryExpr(2, 6, [](auto i, auto k) {
      return std::cos(0.7 * static_cast<double>(k) + static_cast<double>(i));
    });
  }
  RowBlock block;
  Matrix outputs;  // of two trajectories
};

class WhiteningWithAShare : public ::testing::TestWithParam<double> {};

TEST_P(WhiteningWithAShare, IsThatOfTheCholeskyFactor) {
  const double share = GetParam();
  Record record;
  const Record raw;
  const double scale = 2;
  std::vector<int> there = {0, 1, 3, 4, 5};
  Matrix covariance(5, 5);
  Vector z(5);
  Matrix y(5, 2);
  for (int i = 0; i < 5; ++i) {
    const auto k = static_cast<size_t>(there[static_cast<size_t>(i)]);
    z[i] = raw.block.values[k];
    y.row(i) = raw.outputs.col(static_cast<Eigen::Index>(k)).transpose();
    for (int j = 0; j < 5; ++j) {
      const auto l = static_cast<size_t>(there[static_cast<size_t>(j)]);
      const double lag = std::abs(raw.block.rows[k].time_s - raw.block.rows[l].time_s);
      const double correlation = k == l ? 1 : (1 - share) * std::exp(-lag / kTimeConstant);
      covariance(i, j) = scale * scale * raw.block.noise[k] * raw.block.noise[l] * correlation;
    }
  }
  const Matrix factor = covariance.llt().matrixL();
  const Vector white = factor.triangularView<Eigen::Lower>().solve(z);
  const Matrix white_outputs = factor.triangularView<Eigen::Lower>().solve(y);

  Whitening whitening({{.scale = scale, .time_constant_s = kTimeConstant, .white_share = share}},
                      2);
  whitening.BeginRun();
  // The whitening takes the block in two pieces.
  whitening.Apply(0, 4, record.block, record.outputs.leftCols(4));
  whitening.Apply(4, 2, record.block, record.outputs.rightCols(2));
  for (int i = 0; i < 5; ++i) {
    const auto k = static_cast<size_t>(there[static_cast<size_t>(i)]);
    EXPECT_NEAR(record.block.values[k] / record.block.noise[k], white[i], 1e-12);
    for (int trajectory = 0; trajectory < 2; ++trajectory) {
      EXPECT_NEAR(record.outputs(trajectory, static_cast<Eigen::Index>(k)) / record.block.noise[k],
                  white_outputs(i, trajectory), 1e-11);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfWhiteNoise, WhiteningWithAShare, ::testing::Values(0, 0.02, 0.4, 0.98));

TEST(Whitening, BeginsAnewWithARun) {
  Record record;
  const Record raw;
  Whitening whitening({{1, kTimeConstant, true}}, 2);
  whitening.BeginRun();
  whitening.Apply(0, 3, record.block, record.outputs.leftCols(3));
  whitening.BeginRun();
  whitening.Apply(3, 3, record.block, record.outputs.rightCols(3));
  EXPECT_EQ(record.block.values[3], raw.block.values[3]);
  EXPECT_EQ(record.block.noise[3], raw.block.noise[3]);
  EXPECT_EQ(record.outputs.col(3), raw.outputs.col(3));
  EXPECT_NE(record.block.values[4], raw.block.values[4]);
}

TEST(Whitening, ContinuesFromAState) {
  Record whole, restored;
  const std::vector<ChannelNoise> noise = {{.time_constant_s = kTimeConstant, .white_share = 0.4}};
  Whitening first(noise, 2), second(noise, 2);
  first.Apply(0, 6, whole.block, whole.outputs);
  Whitening before(noise, 2);
  before.Apply(0, 4, restored.block, restored.outputs.leftCols(4));
  second.Restore(before.State());
  second.Apply(4, 2, restored.block, restored.outputs.rightCols(2));
  EXPECT_EQ(restored.block.values[5], whole.block.values[5]);
  EXPECT_EQ(restored.block.noise[5], whole.block.noise[5]);
  EXPECT_EQ(restored.outputs.col(5), whole.outputs.col(5));
}

TEST(Whitening, OnlyScalesWhiteNoise) {
  Record record;
  const Record raw;
  Whitening whitening({{3, 0, true}}, 2);
  whitening.BeginRun();
  whitening.Apply(0, 6, record.block, record.outputs);
  EXPECT_EQ(record.outputs, raw.outputs);
  EXPECT_EQ(record.block.noise[5], 3 * raw.block.noise[5]);
  EXPECT_EQ(record.block.noise[2], 0);
}

}  // namespace
}  // namespace polyest::internal::whitening_test
