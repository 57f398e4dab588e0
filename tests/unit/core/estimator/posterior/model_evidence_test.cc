// Tests the evidence of a problem on models that are linear in their parameters, for which it is
// known in closed form: with y = A θ + noise and θ ~ N(m, P), z ~ N(A m, A P Aᵀ + σ² I).

#include "core/estimator/posterior/model_evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

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

// The line with noise that has outliers, against quadrature over both parameters, and over log s
// where the size of the noise is not known: the trapezoidal rule with steps of half a standard
// deviation of the posterior of Gaussian noise, which e^{−2π²/½²} makes exact for Gaussians, out to
// 6 of them, and of 0.025 in log s.
struct WithOutliers {
  OutlierHandling outliers;
  bool unknown;
  int samples;
  double gross;  // share of the samples that are 8 times as far off
};

Samples LineWithGrossErrors(int count, double gross) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal(0, kSigma);
  std::uniform_real_distribution<double> uniform;
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int k = 1; k <= count; ++k) {
    const double t = 4.0 * k / count;
    const double factor = uniform(random) < gross ? 8 : 1;
    samples.time_s.push_back(t);
    samples.columns[0].value.push_back(1.2 + 0.9 * t + factor * normal(random));
  }
  return samples;
}

// Returns log of the density of u, normalized in closed form.
double LogDensity(OutlierHandling outliers, double u) {
  if (outliers == OutlierHandling::kStudentT) {
    return std::log(0.375) - 2.5 * std::log1p(u * u / 4);  // Γ(5/2)/(√(4π) Γ(2)) = 3/8
  }
  constexpr double k = 1.345;
  const double size = std::abs(u);
  const double all = std::sqrt(2 * std::numbers::pi) * std::erf(k / std::numbers::sqrt2) +
                     2 / k * std::exp(-0.5 * k * k);
  return (size > k ? 0.5 * k * k - k * size : -0.5 * u * u) - std::log(all);
}

double LogLikelihood(const Samples& samples, OutlierHandling outliers, double a, double b,
                     double sigma) {
  double sum = 0;
  for (size_t k = 0; k < samples.time_s.size(); ++k) {
    const double error = samples.columns[0].value[k] - a - b * samples.time_s[k];
    sum += LogDensity(outliers, error / sigma) - std::log(sigma);
  }
  return sum;
}

double QuadratureOfLogEvidence(const Samples& samples, const WithOutliers& noise) {
  // Gaussian noise of the stated size has the posterior N(mean, C) with C⁻¹ = AᵀA/σ² + 1/P.
  Matrix precision = Matrix::Identity(2, 2) / (kPriorSd * kPriorSd);
  for (const double t : samples.time_s) {
    const Eigen::Vector2d row(1, t);
    precision += row * row.transpose() / (kSigma * kSigma);
  }
  const Matrix axes = Eigen::LLT<Matrix>(precision.inverse()).matrixL();
  constexpr double kUnit = 0.5, kStep = 0.025;
  std::vector<double> terms;
  for (int i = -12; i <= 12; ++i) {
    for (int j = -12; j <= 12; ++j) {
      const Eigen::Vector2d d = kUnit * axes * Eigen::Vector2d(i, j);
      const double a = 1.2 + d[0], b = 0.9 + d[1];
      const double prior =
          -0.5 * (std::pow((a - kMean) / kPriorSd, 2) + std::pow((b - kSlope) / kPriorSd, 2)) -
          std::log(2 * std::numbers::pi * kPriorSd * kPriorSd);
      const int reach = noise.unknown ? 28 : 0;
      for (int x = -reach; x <= reach; ++x) {
        terms.push_back(prior +
                        LogLikelihood(samples, noise.outliers, a, b, kSigma * std::exp(kStep * x)));
      }
    }
  }
  const double largest = *std::ranges::max_element(terms);
  double sum = 0;
  for (const double term : terms) sum += std::exp(term - largest);
  const double cell = kUnit * kUnit * axes(0, 0) * axes(1, 1) * (noise.unknown ? kStep : 1);
  return largest + std::log(sum * cell);
}

class EvidenceWithOutliers : public ::testing::TestWithParam<WithOutliers> {};

TEST_P(EvidenceWithOutliers, IsThatOfTheirDensity) {
  const WithOutliers& noise = GetParam();
  const Samples samples = LineWithGrossErrors(noise.samples, noise.gross);
  NoiseModel model;
  if (!noise.unknown) model.absolute = kSigma;
  model.unknown = noise.unknown;
  model.outliers = noise.outliers;
  const Posterior posterior = PosteriorOf(LineProblem(model), samples);
  ASSERT_TRUE(posterior.log_evidence.has_value());
  const double exact = QuadratureOfLogEvidence(samples, noise);
  // The density is known to second order about a point within 0.2 standard deviations, with bridge
  // sampling to 0.01 together with the mean over 4000 draws to 0.05. Where the size is unknown, the
  // estimate for its most probable value differs from that at the working one by some 0.2 standard
  // deviations in either parameter, at most by three times as much with 1 % of probability, which
  // is worth ½ · 0.2² to ½ · 2 · 0.4².
  EXPECT_NEAR(*posterior.log_evidence, exact, noise.unknown ? 0.2 : 0.06);
}

std::vector<WithOutliers> AllWithOutliers() {
  std::vector<WithOutliers> all;
  for (const OutlierHandling outliers : {OutlierHandling::kStudentT, OutlierHandling::kHuber}) {
    for (const bool unknown : {false, true}) {
      for (const int samples : {100, 300}) {
        for (const double gross : {0.0, 0.05}) all.push_back({outliers, unknown, samples, gross});
      }
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(ModelEvidence, EvidenceWithOutliers,
                         ::testing::ValuesIn(AllWithOutliers()));

TEST(LogSumOfExponentials, NeedsAllValues) {
  EXPECT_NEAR(*LogSumOfExponentials({-1000.0, -1000.0}), -1000 + std::numbers::ln2, 1e-12);
  EXPECT_FALSE(LogSumOfExponentials({-1000.0, std::nullopt}).has_value());
  EXPECT_FALSE(LogSumOfExponentials({}).has_value());
}

}  // namespace
}  // namespace polyest::internal::model_evidence_test
