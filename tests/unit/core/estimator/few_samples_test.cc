// Tests campaigns of runs that are too short to tell much of their own parameters, with unknown
// noise, so that the noise is learned while these are eliminated.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/testing/records.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

// Free vibrations about rest, y = p cos ω t + q sin ω t, of three samples each; p and q are each
// run's own.
struct Vibration {
  static constexpr double kNoise = 0.1, kOmega = 3.4, kLowest = 2, kHighest = 5;
  static constexpr int kRows = 3;

  static Problem MakeProblem() {
    UncertainParameter p = UncertainParameter::Normal("p", 0, 1).value();
    UncertainParameter q = UncertainParameter::Normal("q", 0, 1).value();
    p.per_run = q.per_run = true;
    Problem problem =
        TextProblem("p*cos(w*t) + q*sin(w*t)",
                    {UncertainParameter::Uniform("w", kLowest, kHighest).value(), p, q}, kNoise);
    problem.measured[0].noise = {.absolute = 1, .unknown = true};
    return problem;
  }

  static double Time(int row) { return 0.4 * (row + 1); }

  static Samples MakeRuns(int count, uint64_t seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    Samples samples;
    samples.columns = {{"y", {}, {}}};
    for (int run = 0; run < count; ++run) {
      const double p = normal(generator), q = normal(generator);
      for (int row = 0; row < kRows; ++row) {
        const double phase = kOmega * Time(row);
        samples.run.push_back(run);
        samples.time_s.push_back(Time(row));
        samples.columns[0].value.push_back(p * std::cos(phase) + q * std::sin(phase) +
                                           kNoise * normal(generator));
      }
    }
    return samples;
  }
};

struct Moments {
  double mean = 0, std_dev = 0;
};

// Returns the posterior of ω by quadrature over it and the noise's standard deviation σ, whose
// prior is 1/σ. Given both, a run's samples are normal with the covariance σ² + cos cosᵀ + sin
// sinᵀ.
Moments PosteriorOfOmega(const Samples& samples) {
  constexpr int kOmegas = 300, kNoises = 120;
  double sum = 0, first = 0, second = 0;
  for (int i = 0; i < kOmegas; ++i) {
    const double omega =
        Vibration::kLowest + (Vibration::kHighest - Vibration::kLowest) * (i + 0.5) / kOmegas;
    Matrix basis(Vibration::kRows, 2);
    for (int row = 0; row < Vibration::kRows; ++row) {
      basis(row, 0) = std::cos(omega * Vibration::Time(row));
      basis(row, 1) = std::sin(omega * Vibration::Time(row));
    }
    for (int k = 0; k < kNoises; ++k) {
      const double sigma = 0.01 * std::pow(200.0, (k + 0.5) / kNoises);
      const Matrix covariance =
          sigma * sigma * Matrix::Identity(Vibration::kRows, Vibration::kRows) +
          basis * basis.transpose();
      const Eigen::LLT<Matrix> factor(covariance);
      double log_likelihood = 0;
      for (size_t at = 0; at < samples.rows(); at += Vibration::kRows) {
        const Vector y =
            Eigen::Map<const Vector>(samples.columns[0].value.data() + at, Vibration::kRows);
        log_likelihood -=
            0.5 * y.dot(factor.solve(y)) + Matrix(factor.matrixL()).diagonal().array().log().sum();
      }
      // The steps of log σ are equal, which is what the prior asks for.
      const double weight = std::exp(log_likelihood);
      sum += weight;
      first += weight * omega;
      second += weight * omega * omega;
    }
  }
  const double mean = first / sum;
  return {mean, std::sqrt(second / sum - mean * mean)};
}

// The noise of ended runs counts as known, although its posterior, which has N − 2R degrees of
// freedom, is as wide as 1/√(2(N − 2R)) of it. That is 0.24 for nine runs, and so much may be wrong
// with the standard deviation of ω.
TEST(FewSamples, OfRunsWithUnknownNoiseAgreeWithQuadrature) {
  constexpr int kRuns = 9;
  for (const uint64_t seed : {1, 2, 3, 4}) {
    SCOPED_TRACE(seed);
    const Samples samples = Vibration::MakeRuns(kRuns, seed);
    const Estimate estimate = EstimateOf(Vibration::MakeProblem(), samples);
    const Moments exact = PosteriorOfOmega(samples);
    const ParameterEstimate& omega = estimate.parameters[0];
    EXPECT_NEAR(omega.mean, exact.mean, 0.25 * exact.std_dev);
    EXPECT_NEAR(omega.posterior_std_dev, exact.std_dev, 0.25 * exact.std_dev);
    EXPECT_GT(estimate.channels[0].noise_std_dev, 0.4 * Vibration::kNoise);
    EXPECT_LT(estimate.channels[0].noise_std_dev, 2.5 * Vibration::kNoise);
  }
}

}  // namespace
}  // namespace polyest::internal
