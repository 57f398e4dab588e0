// Tests the evidence of a problem on models that are linear in their parameters, for which it is
// known in closed form: with y = A θ + noise and θ ~ N(m, P), z ~ N(A m, A P Aᵀ + σ² I).

#include "core/estimator/posterior/model_evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::model_evidence_test {
namespace {

constexpr int kSamples = 40;
constexpr double kSigma = 0.3, kMean = 1.5, kSlope = 0.8, kPriorSd = 0.5;

Samples Line(double curvature) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, kSigma);
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int k = 1; k <= kSamples; ++k) {
    const double t = 0.1 * k;
    samples.time_s.push_back(t);
    samples.columns[0].value.push_back(1.2 + 0.9 * t + curvature * t * t + normal(random));
  }
  return samples;
}

Problem LineProblem(const NoiseModel& noise) {
  Problem problem = TextProblem("a + b*t",
                                {*UncertainParameter::Normal("a", kMean, kPriorSd),
                                 *UncertainParameter::Normal("b", kSlope, kPriorSd)},
                                kSigma);
  problem.measured[0].noise = noise;
  return problem;
}

Posterior PosteriorOf(const Problem& problem, const Samples& samples) {
  const auto estimator = MakeEstimator(problem);
  EXPECT_TRUE(estimator->Append(samples).ok());
  EXPECT_TRUE(estimator->Process().ok());
  return estimator->CurrentPosterior({}).value();
}

// Returns log N(z; A m, A P Aᵀ + σ² I).
double ExactLogEvidence(const Samples& samples, double sigma) {
  Matrix a(kSamples, 2);
  Vector residual(kSamples);
  for (int k = 0; k < kSamples; ++k) {
    const double t = samples.time_s[static_cast<size_t>(k)];
    a.row(k) << 1, t;
    residual[k] = samples.columns[0].value[static_cast<size_t>(k)] - kMean - kSlope * t;
  }
  Matrix covariance = kPriorSd * kPriorSd * a * a.transpose();
  covariance.diagonal().array() += sigma * sigma;
  const Eigen::LLT<Matrix> factor(covariance);
  const double half_log_determinant = factor.matrixLLT().diagonal().array().log().sum();
  return -0.5 * factor.matrixL().solve(residual).squaredNorm() - half_log_determinant -
         0.5 * kSamples * std::log(2 * std::numbers::pi);
}

TEST(ModelEvidence, IsThatOfTheClosedForm) {
  const Samples samples = Line(0);
  const Posterior posterior = PosteriorOf(LineProblem({.absolute = kSigma}), samples);
  ASSERT_TRUE(posterior.log_evidence.has_value());
  // Bridge sampling from 16,384 points of a nearly Gaussian density is good to 0.01.
  EXPECT_NEAR(*posterior.log_evidence, ExactLogEvidence(samples, kSigma), 0.01);
}

// With the noise 5 times too small the posterior is taken from a power of the likelihood, and the
// evidence of a Gaussian is Laplace's.
TEST(ModelEvidence, IsThatOfTheNoiseAsStatedAlsoInAMisfit) {
  const Samples samples = Line(0);
  const Posterior posterior = PosteriorOf(LineProblem({.absolute = kSigma / 5}), samples);
  ASSERT_TRUE(posterior.log_evidence.has_value());
  EXPECT_NEAR(*posterior.log_evidence, ExactLogEvidence(samples, kSigma / 5), 0.05);
}

// Noise of unknown size, against the integral over log s by the trapezoidal rule.
TEST(ModelEvidence, IntegratesNoiseOfUnknownSize) {
  const Samples samples = Line(0);
  const Posterior posterior = PosteriorOf(LineProblem({.unknown = true}), samples);
  ASSERT_TRUE(posterior.log_evidence.has_value());
  constexpr double kStep = 0.01;
  double largest = -kInfinity, sum = 0;
  for (double log_s = std::log(kSigma) - 2; log_s < std::log(kSigma) + 2; log_s += kStep) {
    largest = std::max(largest, ExactLogEvidence(samples, std::exp(log_s)));
  }
  for (double log_s = std::log(kSigma) - 2; log_s < std::log(kSigma) + 2; log_s += kStep) {
    sum += kStep * std::exp(ExactLogEvidence(samples, std::exp(log_s)) - largest);
  }
  EXPECT_NEAR(*posterior.log_evidence, largest + std::log(sum), 0.02);
}

TEST(ModelEvidence, PrefersTheTermThatIsThere) {
  const auto cubic = [](double curvature) {
    const Samples samples = Line(curvature);
    Problem more = TextProblem("a + b*t + c*t^2",
                               {*UncertainParameter::Normal("a", kMean, kPriorSd),
                                *UncertainParameter::Normal("b", kSlope, kPriorSd),
                                *UncertainParameter::Normal("c", 0, kPriorSd)},
                               kSigma);
    return *PosteriorOf(more, samples).log_evidence -
           *PosteriorOf(LineProblem({.absolute = kSigma}), samples).log_evidence;
  };
  EXPECT_GT(cubic(0.3), 5);
  EXPECT_LT(cubic(0), -1);  // a term that is not there costs its prior's width
}

TEST(ModelEvidence, IsNotThereUnderAnotherWeightOfThePrior) {
  Problem problem = LineProblem({.absolute = kSigma});
  problem.regularization = 0.5;
  EXPECT_FALSE(PosteriorOf(problem, Line(0)).log_evidence.has_value());
}

// The two signs of a square are two pieces; either has half of the evidence of |v|.
TEST(ModelEvidence, IsTheSumOverThePiecesOfThePosterior) {
  const auto evidence = [](const UncertainParameter& v) {
    Samples samples;
    samples.time_s = {1, 2, 3, 4};
    samples.columns = {{"y", {1.02, 0.97, 1.01, 0.99}, {}}};
    return PosteriorOf(TextProblem("v^2", {v}, 0.05), samples).log_evidence.value_or(0);
  };
  const double both = evidence(*UncertainParameter::Uniform("v", -3, 3));
  EXPECT_NEAR(both, evidence(*UncertainParameter::Uniform("v", 0, 3)), 0.02);
  EXPECT_GT(both, 1);  // four samples with densities of up to 8
}

TEST(LogSumOfExponentials, NeedsAllValues) {
  EXPECT_NEAR(*LogSumOfExponentials({-1000.0, -1000.0}), -1000 + std::numbers::ln2, 1e-12);
  EXPECT_FALSE(LogSumOfExponentials({-1000.0, std::nullopt}).has_value());
  EXPECT_FALSE(LogSumOfExponentials({}).has_value());
}

}  // namespace
}  // namespace polyest::internal::model_evidence_test
