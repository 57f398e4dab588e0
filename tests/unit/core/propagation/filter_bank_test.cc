#include "core/propagation/filter_bank.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "polyest/equation_model.h"
#include "tests/unit/core/propagation/driven_oscillators.h"

namespace polyest::internal::filter_bank_test {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

const std::vector<DrivenOscillator> kMembers = {
    {40, 0.3, 1, 0, 0.01}, {36, 0.2, 0.5, 1, 0.1}, {42, 0.5, 0, 0, 1e-4}, {39, 0.1, 1, -1, 0}};

// The samples of one channel or two (x, v): the same for each test of a kind.
struct Record {
  std::vector<double> times_s;
  Matrix values, noise;

  FilterSamples samples() const { return {times_s, values, noise}; }
};

Record MakeRecord(int channels, int count, double step_s, double sigma) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  Record record;
  record.values.resize(channels, count);
  record.noise.setConstant(channels, count, sigma);
  for (int k = 0; k < count; ++k) {
    record.times_s.push_back((k + 1) * step_s);
    for (int c = 0; c < channels; ++c) {
      record.values(c, k) = std::cos(6.3 * record.times_s.back() + c) + sigma * normal(random);
    }
  }
  return record;
}

Ensemble Oscillators(std::vector<const char*> outputs,
                     IntegrationMethod method = IntegrationMethod::kAuto) {
  Ensemble ensemble = DrivenOscillatorEnsemble(kMembers, std::move(outputs));
  ensemble.specification.integration.method = method;
  return ensemble;
}

struct Filtered {
  Matrix innovations, log_variances;
};

Filtered Filter(FilterBank& bank, const FilterSamples& samples) {
  const Eigen::Index columns = samples.values.size();
  Filtered result{Matrix(bank.members(), columns), Matrix(bank.members(), columns)};
  EXPECT_TRUE(bank.Advance(samples, result.innovations, result.log_variances, Stop()).ok());
  return result;
}

// The exact Kalman filter of a member with the same discretization of its process noise, in dense
// matrices: the oracle. Reports the whitened innovations and log(S/r), 0 without a sample.
Filtered ExactFilter(const DrivenOscillator& member, const Record& record) {
  Eigen::Matrix2d A, Q = Eigen::Matrix2d::Zero();
  A << 0, 1, -member.k, -member.c;
  Q(1, 1) = member.q;
  Eigen::Vector2d m(member.x0, member.v0);
  Eigen::Matrix2d P = Eigen::Matrix2d::Zero();
  const Eigen::Index channels = record.values.rows();
  Filtered result{Matrix::Zero(1, record.values.size()), Matrix::Zero(1, record.values.size())};
  double last_s = 0;
  for (Eigen::Index k = 0; k < record.values.cols(); ++k) {
    const double step_s = record.times_s[static_cast<size_t>(k)] - last_s;
    last_s = record.times_s[static_cast<size_t>(k)];
    const Eigen::Matrix2d whole = (A * step_s).exp(), half = (A * step_s / 2).exp();
    m = whole * m;
    P = whole * P * whole.transpose() +
        step_s / 6 * (whole * Q * whole.transpose() + 4 * half * Q * half.transpose() + Q);
    for (Eigen::Index c = 0; c < channels; ++c) {
      const double sigma = record.noise(c, k);
      if (!(sigma > 0)) continue;
      const double nu = record.values(c, k) - m[c], S = P(c, c) + sigma * sigma;
      const Eigen::Vector2d gain = P.col(c) / S;
      result.innovations(0, k * channels + c) = nu / std::sqrt(S);
      result.log_variances(0, k * channels + c) = std::log(S / (sigma * sigma));
      m += gain * nu;
      P -= S * gain * gain.transpose();
    }
  }
  return result;
}

double NegativeLogLikelihood(const Filtered& filtered, Eigen::Index member) {
  return 0.5 * (filtered.innovations.row(member).squaredNorm() +
                filtered.log_variances.row(member).sum());
}

// The tolerance of the integrator is 1e-10; with 400 samples of residuals of up to some hundred
// standard deviations the log likelihood is off by less than 1e-6 of itself.
void ExpectExact(const Ensemble& ensemble, const Record& record) {
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const Filtered filtered = Filter(bank, record.samples());
  for (int i = 0; i < bank.members(); ++i) {
    const Filtered exact = ExactFilter(kMembers[static_cast<size_t>(i)], record);
    const double expected = NegativeLogLikelihood(exact, 0);
    EXPECT_NEAR(NegativeLogLikelihood(filtered, i), expected, 1e-6 * expected) << i;
    EXPECT_LT((filtered.log_variances.row(i) - exact.log_variances).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((filtered.innovations.row(i) - exact.innovations).cwiseAbs().maxCoeff(),
              1e-6 * exact.innovations.cwiseAbs().maxCoeff());
  }
}

TEST(FilterBank, HasTheLikelihoodOfAnExactKalmanFilterForALinearModel) {
  ExpectExact(Oscillators({"x"}), MakeRecord(1, 400, 0.05, 0.01));
}

TEST(FilterBank, IsAsExactWithAnAdaptiveIntegrator) {
  ExpectExact(Oscillators({"x"}, IntegrationMethod::kExplicit), MakeRecord(1, 400, 0.05, 0.01));
}

TEST(FilterBank, TakesChannelsOneByOneAndLeavesOutMissingSamples) {
  Record record = MakeRecord(2, 300, 0.05, 0.02);
  record.noise.row(1).setConstant(0.1);
  for (Eigen::Index k = 0; k < 300; ++k) {
    if (k % 3 != 0) record.noise(1, k) = 0;
    if (k % 7 == 2) record.noise(0, k) = 0;
  }
  ExpectExact(Oscillators({"x", "v"}), record);
}

// Noise of 1 nm and 10 µm of diffusion in an interval: what a subtracted covariance loses.
TEST(FilterBank, IsExactWithSensorsFarBetterThanTheModel) {
  Record record = MakeRecord(1, 400, 0.05, 0.01);
  record.noise.setConstant(1e-9);
  Ensemble ensemble = Oscillators({"x"});
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const Filtered filtered = Filter(bank, record.samples());
  for (int i = 0; i < 3; ++i) {
    const Filtered exact = ExactFilter(kMembers[static_cast<size_t>(i)], record);
    const double expected = NegativeLogLikelihood(exact, 0);
    EXPECT_NEAR(NegativeLogLikelihood(filtered, i), expected, 1e-6 * std::abs(expected)) << i;
  }
}

TEST(FilterBank, HasTheResidualsOfTheOutputsWithoutProcessNoise) {
  Ensemble ensemble = Oscillators({"x"}, IntegrationMethod::kExplicit);
  ensemble.specification.process_noise.setZero();
  const Record record = MakeRecord(1, 200, 0.05, 0.01);
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const Filtered filtered = Filter(bank, record.samples());
  const Matrix outputs = ensemble.Propagate(record.times_s);
  EXPECT_LT(filtered.log_variances.cwiseAbs().maxCoeff(), 1e-12);
  const Matrix residuals = (record.values.replicate(bank.members(), 1) - outputs) / 0.01;
  // 1000 tolerances of the integrator, in units of the noise (ensemble_propagator_test.cc).
  EXPECT_LT((filtered.innovations - residuals).cwiseAbs().maxCoeff(), 1000 * 1e-10 / 0.01);
}

// Gaps of 1 s at 6.3 rad/s, over which one step of Simpson's rule is wrong by half: the noise is
// that of the divided interval, which the oracle has in rows without samples.
TEST(FilterBank, DividesLongIntervals) {
  Record fine = MakeRecord(1, 400, 0.05, 0.01);
  Record gaps;
  for (size_t k = 0; k < fine.times_s.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    if ((k + 1) % 20 == 0) {
      gaps.times_s.push_back(fine.times_s[k]);
    } else {
      fine.noise(0, column) = 0;
    }
  }
  gaps.values.resize(1, std::ssize(gaps.times_s));
  for (Eigen::Index k = 0; k < gaps.values.cols(); ++k)
    gaps.values(0, k) = fine.values(0, 20 * k + 19);
  gaps.noise.setConstant(1, gaps.values.cols(), 0.01);
  Ensemble ensemble = Oscillators({"x"});
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const Filtered filtered = Filter(bank, gaps.samples());
  for (int i = 0; i < 3; ++i) {
    const Filtered exact = ExactFilter(kMembers[static_cast<size_t>(i)], fine);
    for (Eigen::Index k = 0; k < gaps.values.cols(); ++k) {
      // Simpson's relative error, (Δt λ)⁴/180 with Δt λ ≤ 1.
      EXPECT_NEAR(filtered.log_variances(i, k), exact.log_variances(0, 20 * k + 19), 1.0 / 180);
    }
  }
}

TEST(FilterBank, HasTheSameBitsForAnyDivisionAndNumberOfThreads) {
  Ensemble ensemble("mass_spring_damper", 50, {"x"});
  ensemble.specification.integration.method = IntegrationMethod::kExplicit;
  ensemble.specification.process_noise.setConstant(50, 2, 0.01);
  for (int i = 0; i < 50; ++i) ensemble.Set("k", i, 30 + 0.3 * i);
  const Record record = MakeRecord(1, 60, 0.05, 0.01);
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const Filtered whole = Filter(bank, record.samples());
  ensemble.specification.threads = 3;
  FilterBank other(ensemble.specification, &ensemble.inputs);
  const std::vector<double> first(record.times_s.begin(), record.times_s.begin() + 17);
  const std::vector<double> second(record.times_s.begin() + 17, record.times_s.end());
  const Filtered one =
      Filter(other, {first, record.values.leftCols(17), record.noise.leftCols(17)});
  const Filtered two =
      Filter(other, {second, record.values.rightCols(43), record.noise.rightCols(43)});
  EXPECT_TRUE(one.innovations == whole.innovations.leftCols(17));
  EXPECT_TRUE(two.innovations == whole.innovations.rightCols(43));
  EXPECT_TRUE(two.log_variances == whole.log_variances.rightCols(43));
}

TEST(FilterBank, ContinuesFromACheckpointWithTheSameBits) {
  Ensemble ensemble = Oscillators({"x"}, IntegrationMethod::kExplicit);
  ensemble.specification.integration.samples_between_checkpoints = 20;
  const Record record = MakeRecord(1, 60, 0.05, 0.01);
  const std::vector<double> first(record.times_s.begin(), record.times_s.begin() + 20);
  const std::vector<double> second(record.times_s.begin() + 20, record.times_s.end());
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  EXPECT_FALSE(bank.State().has_value());
  Filter(bank, {first, record.values.leftCols(20), record.noise.leftCols(20)});
  const std::optional<EnsembleState> state = bank.State();
  ASSERT_TRUE(state.has_value());
  const FilterSamples rest{second, record.values.rightCols(40), record.noise.rightCols(40)};
  const Filtered expected = Filter(bank, rest);
  FilterBank restored(ensemble.specification, &ensemble.inputs);
  ASSERT_TRUE(restored.Restore(*state));
  const Filtered continued = Filter(restored, rest);
  EXPECT_TRUE(continued.innovations == expected.innovations);
  EXPECT_TRUE(continued.log_variances == expected.log_variances);
}

// x′ = k x² from 1 has no solution beyond t = 1/k.
TEST(FilterBank, NamesTheMembersThatFailAndKeepsTheOthers) {
  Ensemble ensemble(
      MakeEquationModel(
          {.states = {{"x", "k*x^2"}}, .outputs = {{"x", "x"}}, .parameters = {{"k", -1}}})
          .value(),
      3, {"x"});
  ensemble.Set("x_0", 1);
  ensemble.specification.process_noise.setConstant(3, 1, 1e-4);
  const Record record = MakeRecord(1, 20, 0.6, 0.1);
  FilterBank healthy(ensemble.specification, &ensemble.inputs);
  const Filtered expected = Filter(healthy, record.samples());
  ensemble.Set("k", 1, 1);
  ensemble.specification.process_noise(2, 0) = -1;
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const Filtered filtered = Filter(bank, record.samples());
  ASSERT_THAT(bank.failures(), SizeIs(2));
  EXPECT_EQ(bank.failures()[0].point, 1);
  EXPECT_NEAR(bank.failures()[0].time_s, 1, 0.1);
  EXPECT_EQ(bank.failures()[1].point, 2);
  EXPECT_THAT(bank.failures()[1].reason, HasSubstr("spectral density"));
  EXPECT_TRUE(std::isnan(filtered.innovations(1, 15)));
  EXPECT_TRUE(std::isnan(filtered.log_variances(2, 0)));
  EXPECT_LT((filtered.innovations.row(0) - expected.innovations.row(0)).cwiseAbs().maxCoeff(),
            1e-6);
}

}  // namespace
}  // namespace polyest::internal::filter_bank_test
