// Compares estimates under lognormal, truncated normal and correlated priors with closed forms and
// quadrature of the exact posterior.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/estimator/studies/cost_grid.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal::priors_test {
namespace {

using ::testing::HasSubstr;

constexpr double kTwoPi = 2 * std::numbers::pi;
// The 2000 particles are worth at least this many (posterior_test.cc).
constexpr double kIndependent = 1000;
const double kMeanError = 4 / std::sqrt(kIndependent);  // in deviations
const double kQuantileError = 4 * std::sqrt(0.025 * 0.975 / kIndependent) / 0.0584;  // of a normal

UncertainParameter Normal(const char* name, double mean, double std_dev) {
  return UncertainParameter::Normal(name, mean, std_dev).value();
}

// Makes the oscillator with x = x0 cos 2πt + v0 sin(2πt)/2π, x0 and v0 normal and correlated.
Problem PairProblem(double rho, double noise) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.uncertain = {Normal("x0", 0.3, 0.1), Normal("v0", 1, 0.5)};
  problem.correlations = {{"x0", "v0", rho}};
  problem.measured = {{"x", {.absolute = noise}}};
  problem.expansion.order = 2;
  return problem;
}

Samples At(const std::vector<double>& time_s, const std::vector<double>& x) {
  Samples samples;
  samples.time_s = time_s;
  samples.columns = {{"x", x, {}}};
  return samples;
}

struct Gaussian {
  Vector mean;
  Matrix covariance;
};

// Returns the covariance (P⁻¹ + AᵀA/σ²)⁻¹ and its mean, with P the prior's covariance.
Gaussian ExactPair(double rho, double noise, const Samples& samples) {
  const auto rows = static_cast<Eigen::Index>(samples.rows());
  Matrix a(rows, 2);
  Vector z(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const double t = samples.time_s[static_cast<size_t>(k)];
    a.row(k) << std::cos(kTwoPi * t), UnitResponse(t);
    z[k] = samples.columns[0].value[static_cast<size_t>(k)];
  }
  Matrix prior(2, 2);
  prior << 0.01, rho * 0.05, rho * 0.05, 0.25;
  const Matrix information = prior.inverse();
  Gaussian exact;
  exact.covariance = (information + a.transpose() * a / (noise * noise)).inverse();
  exact.mean = exact.covariance *
               (information * Eigen::Vector2d(0.3, 1) + a.transpose() * z / (noise * noise));
  return exact;
}

void ExpectPair(const Estimate& estimate, const Gaussian& exact) {
  for (int i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    const double deviation = std::sqrt(exact.covariance(i, i));
    // The tolerance of the integration, 10⁻⁷ of x, is less than 10⁻⁴ of a standard deviation here.
    EXPECT_NEAR(parameter.map, exact.mean[i], 1e-3 * deviation);
    EXPECT_NEAR(parameter.std_dev, deviation, 1e-3 * deviation);
    EXPECT_NEAR(parameter.mean, exact.mean[i], kMeanError * deviation);
    EXPECT_NEAR(parameter.lower95, exact.mean[i] - 1.959964 * deviation,
                kQuantileError * deviation);
    EXPECT_NEAR(parameter.upper95, exact.mean[i] + 1.959964 * deviation,
                kQuantileError * deviation);
    for (int j = 0; j < 2; ++j) {
      EXPECT_NEAR(estimate.covariance(i, j), exact.covariance(i, j),
                  2e-3 * std::sqrt(exact.covariance(i, i) * exact.covariance(j, j)));
    }
  }
}

TEST(CorrelatedPriors, GiveTheGaussianPosteriorOfALinearProblem) {
  for (const double rho : {0.9, -0.6}) {
    const Samples samples = At({0, 0.13, 0.31, 0.71}, {0.35, 0.36, 0.05, -0.2});
    ExpectPair(EstimateOf(PairProblem(rho, 0.02), samples), ExactPair(rho, 0.02, samples));
  }
}

// The data measure x(0) = x0 alone: v0 is known as far as the correlation tells.
TEST(CorrelatedPriors, TellOfOneWhatIsMeasuredOfTheOther) {
  const Samples samples = At({0}, {0.45});
  const Estimate estimate = EstimateOf(PairProblem(0.95, 0.001), samples);
  ExpectPair(estimate, ExactPair(0.95, 0.001, samples));
  EXPECT_EQ(estimate.parameters[1].verdict, Verdict::kIdentified);
  EXPECT_NEAR(estimate.parameters[1].contraction, std::sqrt(1 - 0.95 * 0.95), 0.01);
  // The directions say that the data know one thing only.
  EXPECT_EQ(estimate.directions[1].verdict, Verdict::kNotIdentified);
}

// The data contradict the prior by a hundred of its standard deviations. That is no reason to doubt
// the noise, which would give the prior even more weight.
TEST(CorrelatedPriors, AreNotTakenForWrongNoise) {
  Samples samples = At({}, {});
  for (int k = 0; k < 60; ++k) {
    const double t = 0.05 * (k + 1);
    samples.time_s.push_back(t);
    samples.columns[0].value.push_back(0.4 * std::cos(kTwoPi * t) + 0.5 * UnitResponse(t));
  }
  const Estimate estimate = EstimateOf(PairProblem(0.9999, 0.02), samples);
  const Gaussian exact = ExactPair(0.9999, 0.02, samples);
  EXPECT_TRUE(Has(estimate, DiagnosticCode::kModelMisfit));
  for (int i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    const double deviation = std::sqrt(exact.covariance(i, i));
    EXPECT_NEAR(parameter.map, exact.mean[i], 0.01 * deviation);
    EXPECT_GE(parameter.std_dev, 0.99 * deviation);
  }
}

TEST(CorrelatedPriors, AreWhatAnEstimateWithoutDataIs) {
  const Estimate estimate = MakeEstimator(PairProblem(0.9, 0.02))->CurrentEstimate().value();
  for (const ParameterEstimate& parameter : estimate.parameters) {
    EXPECT_NEAR(parameter.std_dev, parameter.prior_std_dev, 1e-12);
    EXPECT_EQ(parameter.verdict, Verdict::kNotIdentified);
  }
  EXPECT_NEAR(estimate.covariance(0, 1), 0.9 * 0.1 * 0.5, 1e-9);
}

TEST(CorrelatedPriors, OfOtherFamiliesAreWhatAnEstimateWithoutDataIs) {
  Problem problem = PairProblem(0.7, 0.02);
  problem.uncertain = {UncertainParameter::Lognormal("x0", 0.3, 0.1).value(),
                       UncertainParameter::Uniform("v0", 0, 2).value()};
  const Estimate estimate = MakeEstimator(problem)->CurrentEstimate().value();
  for (const ParameterEstimate& parameter : estimate.parameters) {
    EXPECT_NEAR(parameter.std_dev, parameter.prior_std_dev, 1e-12);
    EXPECT_NEAR(parameter.mean, parameter.prior_mean, kMeanError * parameter.prior_std_dev);
    EXPECT_EQ(parameter.verdict, Verdict::kNotIdentified);
  }
  // The density is uniform on [0, 2]; the standard error of its quantiles is √(p(1 − p)/N)/½.
  EXPECT_NEAR(estimate.parameters[1].lower95, 0.05,
              4 * std::sqrt(0.025 * 0.975 / kIndependent) * 2);
  EXPECT_NEAR(estimate.parameters[1].upper95, 1.95,
              4 * std::sqrt(0.025 * 0.975 / kIndependent) * 2);
  ExpectFinite(estimate);
}

// Holds the likelihood of x = v0 a, a = sin(2πt)/2π: with measurements z the mismatch is ½ I (v0 −
// v̂)² + const.
struct Likelihood {
  double best;
  double information;
};

Likelihood LikelihoodOf(const Samples& samples, double noise) {
  double s = 0, information = 0;
  for (size_t k = 0; k < samples.rows(); ++k) {
    const double a = UnitResponse(samples.time_s[k]) / noise;
    s += a * samples.columns[0].value[k] / noise;
    information += a * a;
  }
  return {s / information, information};
}

struct Moments {
  double mean, std_dev;
};

// Returns the moments of θ(ξ) under ρ(ξ) e^{−½ I (θ − best)²}, by the trapezoidal rule on [lower,
// upper]. The rule is exact to rounding if the integrand vanishes at both ends, and to step²
// otherwise.
Moments ExactMoments(const Prior& prior, const Likelihood& likelihood, double lower, double upper) {
  constexpr int kSteps = 200'000;
  double sums[3] = {0, 0, 0};
  for (int i = 0; i <= kSteps; ++i) {
    const Vector xi = Vector::Constant(1, lower + (upper - lower) * i / kSteps);
    const double theta = prior.ToParameters(xi)[0];
    const double error = theta - likelihood.best;
    const double weight =
        (i == 0 || i == kSteps ? 0.5 : 1) *
        std::exp(-0.5 * likelihood.information * error * error - prior.NegativeLogDensity(xi));
    for (int k = 0; k < 3; ++k) sums[k] += weight * std::pow(theta, k);
  }
  const double mean = sums[1] / sums[0];
  return {mean, std::sqrt(sums[2] / sums[0] - mean * mean)};
}

TEST(LognormalPriors, GiveTheExactPosteriorsMeanAndItsModeInLogarithms) {
  const double noise = 0.05;
  const Samples samples = InitialVelocityRecord({0.13, 0.31, 0.71, 1.2}, 1.5, noise);
  const UncertainParameter v0 = UncertainParameter::Lognormal("v0", 1, 0.4).value();
  Problem problem = InitialVelocityProblem(v0, noise);
  problem.expansion.order = 6;
  const Estimate estimate = EstimateOf(problem, samples);
  const ParameterEstimate& parameter = estimate.parameters[0];
  const Likelihood likelihood = LikelihoodOf(samples, noise);
  const Moments exact = ExactMoments(Prior({v0}), likelihood, -8, 8);
  EXPECT_NEAR(parameter.mean, exact.mean, kMeanError * exact.std_dev);
  // The mode minimizes J = ½ I (θ − v̂)² + ½ ξ² with θ = e^{μ + σξ}. Bisection solves J′ = I (θ −
  // v̂) σθ + ξ = 0.
  double low = -8, high = 8;
  for (int i = 0; i < 100; ++i) {
    const double xi = 0.5 * (low + high), theta = v0.ToParameter(xi);
    const double slope = likelihood.information * (theta - likelihood.best) * v0.scale * theta + xi;
    (slope < 0 ? low : high) = xi;
  }
  const double theta = v0.ToParameter(low);
  EXPECT_NEAR(parameter.map, theta, 1e-2 * exact.std_dev);
  // The curvature is J″ = I σ²θ (2θ − v̂) + 1; the moments are then those of a lognormal.
  const double curvature =
      likelihood.information * v0.scale * v0.scale * theta * (2 * theta - likelihood.best) + 1;
  const double variance = v0.scale * v0.scale / curvature;
  EXPECT_NEAR(parameter.std_dev, theta * std::exp(0.5 * variance) * std::sqrt(std::expm1(variance)),
              1e-2 * exact.std_dev);
  EXPECT_GT(parameter.lower95, 0);
}

TEST(LognormalPriors, AreWhatAnEstimateFromNothingIs) {
  const UncertainParameter v0 = UncertainParameter::Lognormal("v0", 1, 0.8).value();
  Problem problem = InitialVelocityProblem(v0, 0.02);
  problem.expansion.order = 5;
  for (const bool measured : {false, true}) {
    // The sample says nothing, because x(0) = 0 for every v0.
    const Estimate estimate = measured ? EstimateOf(problem, At({0}, {0.01}))
                                       : MakeEstimator(problem)->CurrentEstimate().value();
    const ParameterEstimate& parameter = estimate.parameters[0];
    EXPECT_NEAR(parameter.map, 1 / std::sqrt(1.64), 1e-4);  // the median
    EXPECT_NEAR(parameter.std_dev, 0.8, 1e-12);
    EXPECT_NEAR(parameter.prior_mean, 1, 1e-12);
    EXPECT_NEAR(parameter.contraction, 1, 1e-12);
    EXPECT_EQ(parameter.verdict, Verdict::kNotIdentified);
    EXPECT_NEAR(parameter.mean, 1, kMeanError * 0.8);
  }
}

TEST(TruncatedNormalPriors, GiveTheExactPosterior) {
  const double noise = 0.05;
  // The samples say little more than nothing.
  const Samples samples = At({0.13, 0.31, 0.71}, {0.005, 0.01, -0.02});
  const UncertainParameter v0 = UncertainParameter::TruncatedNormal("v0", 0.2, 0.5, 0).value();
  const Estimate estimate = EstimateOf(InitialVelocityProblem(v0, noise), samples);
  const ParameterEstimate& parameter = estimate.parameters[0];
  const Prior prior({v0});
  const Likelihood likelihood = LikelihoodOf(samples, noise);
  const Moments exact = ExactMoments(prior, likelihood, prior.lower()[0], 9);
  EXPECT_NEAR(parameter.mean, exact.mean, kMeanError * exact.std_dev);
  EXPECT_GE(parameter.lower95, 0);
  // The mode of the product of two normal densities cut at 0 is the precision-weighted mean.
  const double precision = likelihood.information + 4;
  const double mode = (likelihood.information * likelihood.best + 4 * 0.2) / precision;
  ASSERT_GT(mode, 0);
  EXPECT_NEAR(parameter.map, mode, 1e-3 / std::sqrt(precision));
}

TEST(TruncatedNormalPriors, LeaveTheBoundToTheDataToBeBlamedFor) {
  // The prior is densest at its lower bound, so that the estimate lies there although no data ask
  // for it.
  const UncertainParameter v0 = UncertainParameter::TruncatedNormal("v0", -1, 1, 0).value();
  const Problem problem = InitialVelocityProblem(v0, 0.01);
  const Estimate silent = MakeEstimator(problem)->CurrentEstimate().value();
  EXPECT_NEAR(silent.parameters[0].map, 0, 1e-6);
  EXPECT_NEAR(silent.parameters[0].std_dev, silent.parameters[0].prior_std_dev, 1e-9);
  EXPECT_EQ(silent.parameters[0].verdict, Verdict::kNotIdentified);
  EXPECT_FALSE(Has(silent, DiagnosticCode::kAtPriorBound));
  const Estimate negative =
      EstimateOf(problem, InitialVelocityRecord({0.13, 0.31, 0.71}, -1, 0.01));
  EXPECT_THAT(Message(negative, DiagnosticCode::kAtPriorBound),
              HasSubstr("v0 lies on the lower bound"));
}

TEST(CorrelatedPriors, ShowWhenTheDataAskForValuesBeyondTheMarginal) {
  Problem problem = PairProblem(0.5, 1e-3);
  problem.uncertain[1] = UncertainParameter::Uniform("v0", 0, 1).value();
  std::vector<double> x;
  const std::vector<double> times = {0, 0.1, 0.2, 0.3, 0.4};
  for (const double t : times) x.push_back(0.3 * std::cos(kTwoPi * t) + 1.2 * UnitResponse(t));
  const Estimate estimate = EstimateOf(problem, At(times, x));
  EXPECT_LE(estimate.parameters[1].upper95, 1);
  // The score of a correlated parameter only approaches its bound, so that the contradiction shows
  // as residuals that are larger than the noise.
  EXPECT_GT(estimate.parameters[1].map, 0.9);
  EXPECT_TRUE(Has(estimate, DiagnosticCode::kModelMisfit));
}

TEST(CorrelatedPriors, GiveACostGridTheirDensity) {
  Problem problem = PairProblem(0.9, 0.02);
  problem.uncertain[0] = UncertainParameter::Lognormal("x0", 0.3, 0.1).value();
  const ResolvedProblem resolved = ResolvedProblem::Make(problem).value();
  CostGridOptions options;
  options.points = 5;
  const CostGrid grid = EvaluateCostGrid(resolved, At({0}, {0.3}), options, Stop()).value();
  EXPECT_GT(grid.axes[0].minCoeff(), 0);
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) {
      // The scores are −4, −2 … 4; −log of the density of the germs is zᵀP⁻¹z/2 + log 2π.
      const double u = 2 * i - 4, v = 2 * j - 4;
      const double quadratic = (u * u - 2 * 0.9 * u * v + v * v) / (1 - 0.81);
      EXPECT_NEAR(grid.prior(i, j), 0.5 * quadratic + std::log(kTwoPi), 1e-9);
      const double error = (0.3 - grid.axes[0][i]) / 0.02;
      EXPECT_NEAR(grid.mismatch(i, j), 0.5 * error * error, 1e-6);
    }
  }
}

TEST(CorrelatedPriors, AreRefusedWithTheirPlace) {
  Problem problem = PairProblem(0.5, 0.02);
  problem.correlations.push_back({"x0", "k", 0.1});
  EXPECT_EQ(ResolvedProblem::Make(problem).status().message(),
            "correlations[1]: unknown parameter \"k\"; uncertain are x0, v0");
}

TEST(TruncatedNormalPriors, RefuseAnOrderTheyHaveNoPolynomialsFor) {
  Problem problem = InitialVelocityProblem(
      UncertainParameter::TruncatedNormal("v0", 0, 1, 0, kInfinity).value(), 0.02);
  problem.expansion.order = 101;
  EXPECT_EQ(ResolvedProblem::Make(problem).status().message(),
            "expansion.order: 101 must be at most 100 with the truncated normal prior of v0");
}

}  // namespace
}  // namespace polyest::internal::priors_test
