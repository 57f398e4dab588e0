// Tests estimates whose exact value is known.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::estimates_test {
namespace {

using ::testing::HasSubstr;

constexpr double kNoise = 0.02;  // m
// The particles of an estimate are worth at least half their number (posterior_test.cc).
constexpr double kParticles = 2000;

std::vector<double> InformativeTimes() { return {0, 0.13, 0.31, 0.71, 1.2, 1.77}; }

// Holds Σ a z/σ² and Σ a²/σ² of x = a v0, a = sin(2πt)/2π. The mismatch in v0 is ½ I v0² − S v0 +
// const.
struct Sums {
  double s = 0;
  double information = 0;

  double best() const { return s / information; }
  double std_dev() const { return 1 / std::sqrt(information); }
};

Sums SumsOf(const Samples& samples, double noise) {
  Sums sums;
  for (size_t k = 0; k < samples.rows(); ++k) {
    if (!samples.columns[0].missing.empty() && samples.columns[0].missing[k]) continue;
    const double a = UnitResponse(samples.time_s[k]);
    sums.s += a * samples.columns[0].value[k] / (noise * noise);
    sums.information += a * a / (noise * noise);
  }
  return sums;
}

void ExpectGaussian(const ParameterEstimate& parameter, const Sums& exact) {
  // The relative tolerance of the integration, 10⁻⁷ of x, is 10⁻⁵ of a standard deviation here.
  EXPECT_NEAR(parameter.map, exact.best(), 1e-4 * exact.std_dev());
  EXPECT_NEAR(parameter.std_dev, exact.std_dev(), 1e-4 * exact.std_dev());
  const double standard_error = exact.std_dev() / std::sqrt(kParticles / 2);
  EXPECT_NEAR(parameter.mean, exact.best(), 4 * standard_error);
  // The error of a 2.5 % quantile is √(p (1 − p)/N)/density, with the density φ(1.96)/s = 0.0584/s.
  const double quantile_error = 4 * std::sqrt(0.025 * 0.975) / 0.0584 * standard_error;
  EXPECT_NEAR(parameter.lower95, exact.best() - 1.959964 * exact.std_dev(), quantile_error);
  EXPECT_NEAR(parameter.upper95, exact.best() + 1.959964 * exact.std_dev(), quantile_error);
}

UncertainParameter Uniform(double lower, double upper) {
  return UncertainParameter::Uniform("v0", lower, upper).value();
}

UncertainParameter PapersBeta() { return UncertainParameter::Beta("v0", 2, 2, 0.5, 1.5).value(); }

TEST(Estimates, OfALinearProblemWithAUniformPriorAreLeastSquares) {
  const Samples samples = InitialVelocityRecord(InformativeTimes(), 1.115, kNoise);
  const Estimate estimate = EstimateOf(InitialVelocityProblem(Uniform(0, 2), kNoise), samples);
  const Sums exact = SumsOf(samples, kNoise);
  ASSERT_LT(exact.std_dev(), 0.1);  // far from the bounds
  ExpectGaussian(estimate.parameters[0], exact);
  EXPECT_NEAR(estimate.covariance(0, 0), 1 / exact.information, 1e-3 / exact.information);
  double chi_squared = 0;
  for (size_t k = 0; k < samples.rows(); ++k) {
    const double error =
        samples.columns[0].value[k] - exact.best() * UnitResponse(samples.time_s[k]);
    chi_squared += error * error / (kNoise * kNoise);
  }
  EXPECT_NEAR(estimate.channels[0].chi_squared, chi_squared, 1e-4);
  EXPECT_NEAR(estimate.cost.mismatch, 0.5 * chi_squared, 1e-4);
  EXPECT_EQ(estimate.channels[0].samples, 6);
  EXPECT_NEAR(estimate.channels[0].noise_std_dev, kNoise, 1e-15);
  EXPECT_EQ(estimate.parameters[0].unit, "m/s");
  EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kIdentified);
  EXPECT_THAT(estimate.diagnostics, ::testing::IsEmpty());
}

// About the prior's mean the squares of the errors sum up to 2000 · 10¹⁴, of which rounding leaves
// some tens. The residuals are 2000 numbers of 1.
TEST(Estimates, OfASensorFarMorePreciseThanThePriorAreLeastSquares) {
  constexpr double kPrecise = 1e-8;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  std::vector<double> values;
  Sums exact;
  for (int k = 1; k <= 2000; ++k) {
    const double slope = 1 + 1e-3 * k;
    values.push_back(0.3 * slope + kPrecise * normal(generator));
    exact.s += slope * values.back() / (kPrecise * kPrecise);
    exact.information += slope * slope / (kPrecise * kPrecise);
  }
  const Problem problem =
      TextProblem("a*(1 + t/1000)", {UncertainParameter::Uniform("a", 0, 1).value()}, kPrecise);
  const Estimate estimate = Processed(problem, values)->CurrentEstimate().value();
  double chi_squared = 0;
  for (int k = 1; k <= 2000; ++k) {
    const double error = values[static_cast<size_t>(k - 1)] - exact.best() * (1 + 1e-3 * k);
    chi_squared += error * error / (kPrecise * kPrecise);
  }
  EXPECT_NEAR(estimate.channels[0].chi_squared, chi_squared, 1e-4 * chi_squared);
  ExpectGaussian(estimate.parameters[0], exact);
  EXPECT_NEAR(estimate.parameters[0].posterior_std_dev, exact.std_dev(),
              4 * exact.std_dev() / std::sqrt(kParticles));
  EXPECT_THAT(estimate.diagnostics, ::testing::IsEmpty());
}

// The oracle is the root of J′ for J = ½ I (v0 − v̂)² − log(1 − ξ²), v0 = 1 + ξ/2, by Newton's
// method.
TEST(Estimates, OfALinearProblemWithThePapersPriorBalanceBoth) {
  const double noise = 0.05;
  const Samples samples = InitialVelocityRecord(InformativeTimes(), 1.115, noise);
  const Estimate estimate = EstimateOf(InitialVelocityProblem(PapersBeta(), noise), samples);
  const Sums exact = SumsOf(samples, noise);
  double xi = 0, curvature = 0;
  for (int i = 0; i < 50; ++i) {
    const double room = 1 - xi * xi;
    const double slope = 0.5 * exact.information * (1 + 0.5 * xi - exact.best()) + 2 * xi / room;
    curvature = 0.25 * exact.information + 2 * (1 + xi * xi) / (room * room);
    xi -= slope / curvature;
  }
  const double std_dev = 0.5 / std::sqrt(curvature);
  // The prior does pull the estimate.
  EXPECT_GT(std::abs(1 + 0.5 * xi - exact.best()), 0.05 * std_dev);
  EXPECT_NEAR(estimate.parameters[0].map, 1 + 0.5 * xi, 1e-4 * std_dev);
  EXPECT_NEAR(estimate.parameters[0].std_dev, std_dev, 1e-4 * std_dev);
  EXPECT_NEAR(estimate.parameters[0].prior_std_dev, std::sqrt(0.05), 1e-12);
}

TEST(Estimates, WithoutDataAreThePrior) {
  for (const UncertainParameter& v0 :
       {Uniform(0.5, 1.5), PapersBeta(), UncertainParameter::Normal("v0", 1, 0.2).value()}) {
    const auto estimator = MakeEstimator(InitialVelocityProblem(v0, kNoise));
    const Estimate estimate = estimator->CurrentEstimate().value();
    const ParameterEstimate& parameter = estimate.parameters[0];
    const double mean_error = 4 * parameter.prior_std_dev / std::sqrt(kParticles / 2);
    EXPECT_NEAR(parameter.mean, parameter.prior_mean, mean_error);
    EXPECT_NEAR(parameter.std_dev, parameter.prior_std_dev, 1e-9);
    EXPECT_NEAR(parameter.contraction, 1, 1e-9);
    EXPECT_EQ(parameter.verdict, Verdict::kNotIdentified);
    EXPECT_EQ(estimate.samples, 0);
    EXPECT_TRUE(Has(estimate, DiagnosticCode::kNotIdentified));
    ExpectFinite(estimate);
  }
}

// The sample says nothing, because x(0) = 0 for every v0.
TEST(Estimates, FromDataThatSayNothingAreThePrior) {
  for (const UncertainParameter& v0 : {Uniform(0.5, 1.5), PapersBeta()}) {
    const Samples samples = InitialVelocityRecord({0}, 1.115, kNoise);
    const Estimate estimate = EstimateOf(InitialVelocityProblem(v0, kNoise), samples);
    const ParameterEstimate& parameter = estimate.parameters[0];
    EXPECT_NEAR(parameter.mean, 1, 4 * parameter.prior_std_dev / std::sqrt(kParticles / 2));
    EXPECT_NEAR(parameter.std_dev, parameter.prior_std_dev, 1e-9);
    EXPECT_THAT(Message(estimate, DiagnosticCode::kNotIdentified), HasSubstr("v0"));
    // The record has only one time, which is no sampling.
    EXPECT_FALSE(Has(estimate, DiagnosticCode::kUndersampled));
  }
}

// Figure 4 has two samples a period, each on a zero crossing. The noise is 1 % of each value and
// 0.1 % of the largest, and at least 10⁻⁶, which keeps rounding errors from being a signal.
TEST(Estimates, FromFigureFoursSamplesAreThePriorAndSayWhy) {
  Problem problem = InitialVelocityProblem(PapersBeta(), 0);
  problem.measured[0].noise = {.relative = 0.01, .relative_to_max = 0.001, .least = 1e-6};
  std::vector<double> times;
  for (int k = 1; k <= 10; ++k) times.push_back(0.5 * k);
  const Estimate estimate = EstimateOf(problem, InitialVelocityRecord(times, 1.115, 0));
  const ParameterEstimate& v0 = estimate.parameters[0];
  EXPECT_NEAR(v0.map, 1, 0.01);  // the prior's mode
  EXPECT_NEAR(v0.std_dev, std::sqrt(0.05), 1e-6);
  EXPECT_NEAR(v0.mean, 1, 4 * std::sqrt(0.05) / std::sqrt(kParticles / 2));
  EXPECT_TRUE(Has(estimate, DiagnosticCode::kNotIdentified));
  EXPECT_THAT(Message(estimate, DiagnosticCode::kUndersampled), HasSubstr("v0"));
}

// The data measure only k/m: ω̄ is known to σ/√N, and nothing is known along the valley.
TEST(Estimates, KeepTheValleyOfMassAndStiffness) {
  constexpr double kOmega = 2 * std::numbers::pi;
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_frequency");
  const double k0 = 200 * kOmega * kOmega;
  problem.uncertain = {UncertainParameter::Uniform("m", 190, 210).value(),
                       UncertainParameter::Uniform("k", 0.8 * k0, 1.2 * k0).value()};
  const double noise = 1e-4 * kOmega;
  problem.measured = {{"omega", {.absolute = noise}}};
  problem.expansion.order = 4;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal(1.01 * kOmega, noise);
  Samples samples;
  samples.columns = {{"omega", {}, {}}};
  double mean = 0;
  for (int i = 0; i < 11; ++i) {
    samples.time_s.push_back(i);
    samples.columns[0].value.push_back(normal(generator));
    mean += samples.columns[0].value.back() / 11;
  }
  const Estimate estimate = EstimateOf(problem, samples);
  const ParameterEstimate& m = estimate.parameters[0];
  const ParameterEstimate& k = estimate.parameters[1];
  const double relative = 1e-4 / std::sqrt(11) / 1.01;
  EXPECT_NEAR(std::sqrt(k.map / m.map) / mean, 1, 0.1 * relative);
  // The error of ω follows from d log ω = ½ (dk/k − dm/m).
  const double variance = 0.25 * (estimate.covariance(1, 1) / (k.map * k.map) -
                                  2 * estimate.covariance(0, 1) / (k.map * m.map) +
                                  estimate.covariance(0, 0) / (m.map * m.map));
  EXPECT_NEAR(std::sqrt(variance) / relative, 1, 0.1);
  // The direction of the valley is (4, 1)/√17 in units of the prior's half widths, 5 % and 20 %.
  EXPECT_NEAR(m.contraction, 4 / std::sqrt(17), 0.02);
  // The posterior of m is ∝ m on its prior's range. The error of the 2.5 % quantiles is 4 √(0.025 ·
  // 0.975/1000) × 20 kg.
  const auto quantile = [](double p) {
    return std::sqrt(190.0 * 190 + p * (210.0 * 210 - 190.0 * 190));
  };
  EXPECT_NEAR(m.lower95, quantile(0.025), 0.4);
  EXPECT_NEAR(m.upper95, quantile(0.975), 0.4);
  ASSERT_EQ(estimate.directions.size(), 2u);
  EXPECT_EQ(estimate.directions[0].verdict, Verdict::kIdentified);
  EXPECT_EQ(estimate.directions[1].verdict, Verdict::kNotIdentified);
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kMultipleMinima));
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kExpansionInaccurate));
}

// The model starts again with every run, and the information of the runs adds up.
TEST(Estimates, FromSeveralRunsHoldTheInformationOfAll) {
  Samples samples = InitialVelocityRecord(InformativeTimes(), 1.115, kNoise, 1);
  const Samples second = InitialVelocityRecord({0.2, 0.7, 2.3}, 1.115, kNoise, 2);
  samples.run.assign(samples.rows(), 0);
  samples.run.insert(samples.run.end(), 3, 1);
  samples.time_s.insert(samples.time_s.end(), second.time_s.begin(), second.time_s.end());
  samples.columns[0].value.insert(samples.columns[0].value.end(), second.columns[0].value.begin(),
                                  second.columns[0].value.end());
  const Problem problem = InitialVelocityProblem(Uniform(0, 2), kNoise);
  const Estimate estimate = EstimateOf(problem, samples);
  ExpectGaussian(estimate.parameters[0], SumsOf(samples, kNoise));
  EXPECT_EQ(estimate.time_s, 2.3);
  EXPECT_EQ(estimate.samples, 9);
}

TEST(Estimates, LeaveMissingSamplesOut) {
  Samples samples = InitialVelocityRecord(InformativeTimes(), 1.115, kNoise);
  samples.columns[0].missing = {false, true, false, false, true, false};
  samples.columns[0].value[1] = std::nan("");
  samples.columns[0].value[4] = 1e6;
  const Estimate estimate = EstimateOf(InitialVelocityProblem(Uniform(0, 2), kNoise), samples);
  ExpectGaussian(estimate.parameters[0], SumsOf(samples, kNoise));
  EXPECT_EQ(estimate.samples, 4);
  EXPECT_EQ(estimate.channels[0].samples, 4);
}

// The record has a hundred samples over ten periods with noise 10⁻⁶ of the signal. At the default
// tolerance the explicit integration would err by more than the standard deviation; by itself this
// linear model would be stepped without error.
TEST(Estimates, OfAPreciseRecordDoNotShowTheIntegration) {
  const double noise = 1e-6;
  std::vector<double> times;
  for (int k = 1; k <= 100; ++k) times.push_back(0.0973 * k);
  const Samples samples = InitialVelocityRecord(times, 7, noise);  // x stays within 1.1 m.
  const Sums exact = SumsOf(samples, noise);
  Problem problem = InitialVelocityProblem(Uniform(5, 9), noise);
  problem.integration.method = IntegrationMethod::kExplicit;
  const Estimate estimate = EstimateOf(problem, samples);
  EXPECT_NEAR((estimate.parameters[0].map - exact.best()) / exact.std_dev(), 0, 0.1);
  EXPECT_NEAR(estimate.parameters[0].std_dev / exact.std_dev(), 1, 0.02);
  problem.tolerance_follows_noise = false;
  problem.integration.relative_tolerance = 1e-5;
  const Estimate loose = EstimateOf(problem, samples);
  EXPECT_GT(std::abs(loose.parameters[0].map - exact.best()) / exact.std_dev(), 0.5);
}

}  // namespace
}  // namespace polyest::internal::estimates_test
