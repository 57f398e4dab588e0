// Tests what gross errors do to the verdict on model and noise and to the size of the noise, where
// their handling was asked for. The model y = a + b t is linear, so that the oracle is in closed
// form: the covariance of least squares with the true noise.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "core/bayes/noise.h"
#include "core/estimator/posterior/residual_tests.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::gross_errors_test {
namespace {

constexpr double kNoise = 0.01;
constexpr int kSamples = 300;

struct Disturbance {
  double share = 0;    // of gross errors, …
  double size = 30;    // … and their standard deviation, in units of the noise
  double noise = 1;    // of all samples, in units of what is stated
  double missing = 0;  // amplitude of what the model lacks, in units of the noise
};

std::vector<double> Values(const Disturbance& disturbance, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<double> values;
  for (int i = 1; i <= kSamples; ++i) {
    const double e = disturbance.noise * normal(random);
    const double gross =
        uniform(random) < disturbance.share ? disturbance.size * normal(random) : 0;
    const double missing = disturbance.missing * std::sin(0.3 * i);
    values.push_back(1 + 0.01 * i + kNoise * (e + gross + missing));
  }
  return values;
}

Estimate EstimateWith(const NoiseModel& noise, const std::vector<double>& values) {
  Problem problem = TextProblem(
      "a + b*t",
      {*UncertainParameter::Uniform("a", 0, 2), *UncertainParameter::Uniform("b", 0, 0.02)},
      kNoise);
  problem.measured[0].noise = noise;
  return Processed(problem, values)->CurrentEstimate().value();
}

class GrossErrorsOrMisfit : public ::testing::TestWithParam<OutlierHandling> {
 protected:
  NoiseModel Known() const { return {.absolute = kNoise, .outliers = GetParam()}; }
  NoiseModel Unknown() const { return {.unknown = true, .outliers = GetParam()}; }

  int Misfits(const Disturbance& disturbance, int records = 6) const {
    int misfits = 0;
    for (int seed = 1; seed <= records; ++seed) {
      const Estimate estimate = EstimateWith(Known(), Values(disturbance, seed));
      if (Has(estimate, DiagnosticCode::kModelMisfit)) ++misfits;
    }
    return misfits;
  }
};

TEST_P(GrossErrorsOrMisfit, AreNoMisfitOfARightModel) {
  EXPECT_EQ(Misfits({}), 0);
  EXPECT_EQ(Misfits({.share = 0.1}), 0);
  EXPECT_EQ(Misfits({.share = 0.1, .size = 1000}), 0);
}

TEST_P(GrossErrorsOrMisfit, AreNotAsManyAsTheMethodIsFor) {
  const bool huber = GetParam() == OutlierHandling::kHuber;
  EXPECT_EQ(Misfits({.share = huber ? 0.25 : 0.2}), huber ? 6 : 0);
  EXPECT_EQ(Misfits({.share = 0.5}), 6);
}

TEST_P(GrossErrorsOrMisfit, LeaveTheChiSquaredOfTheOthers) {
  const Estimate estimate = EstimateWith(Known(), Values({.share = 0.1}, 1));
  EXPECT_NEAR(estimate.channels[0].chi_squared, kSamples, 4 * std::sqrt(2.0 * kSamples));
}

// With gross errors and without.
TEST_P(GrossErrorsOrMisfit, DoNotHideAWrongModelOrNoise) {
  for (const double share : {0.0, 0.1}) {
    EXPECT_EQ(Misfits({.share = share, .missing = 3}, 3), 3) << share;
    EXPECT_EQ(Misfits({.share = share, .missing = 100}, 3), 3) << share;
    EXPECT_EQ(Misfits({.share = share, .noise = 2}, 3), 3) << share;
    EXPECT_EQ(Misfits({.share = share, .noise = 30}, 3), 3) << share;
  }
}

// Returns the variance of an M-estimate relative to that of least squares without gross errors,
// E[ψ²]/E[ψ′]², for this share of gross errors. Far off, ψ is 0 for Student's t and k for Huber.
double VarianceOfEstimate(OutlierHandling outliers, double share) {
  const double good = 1 - share;
  if (outliers == OutlierHandling::kStudentT) return 1.0801 / good;
  return (good * 0.7102 + share * kHuberThreshold * kHuberThreshold) / std::pow(good * 0.8214, 2);
}

// Returns σ in units of that of the good samples for which E[χ(u)] is what it is without gross
// errors, by quadrature: gross errors of 30 standard deviations count as OutlierDegrees.
double ScaleOfEstimate(OutlierHandling outliers, double share) {
  return 1 + share * (outliers == OutlierHandling::kStudentT ? 0.33 : 1.06);
}

// The oracle is the asymptotic theory of M-estimates (Huber, Robust Statistics, 1981, §3.2 and 7.6)
// for the slope of a line.
TEST_P(GrossErrorsOrMisfit, DoNotRaiseANoiseOfUnknownSize) {
  const double of_times = kSamples * (std::pow(kSamples, 2) - 1) / 12.0;  // Σ (t − mean)²
  for (const double share : {0.0, 0.05, 0.1}) {
    double noise = 0, std_dev = 0;
    constexpr int kRecords = 6;
    for (int seed = 1; seed <= kRecords; ++seed) {
      const Estimate estimate = EstimateWith(Unknown(), Values({.share = share}, seed));
      noise += estimate.channels[0].noise_std_dev / kRecords;
      std_dev += estimate.parameters[1].posterior_std_dev / kRecords;
    }
    const double oracle = kNoise * std::sqrt(VarianceOfEstimate(GetParam(), share) / of_times);
    // Of the samples that are no outliers √Var[w u²]/E[w u²] is 1, and their mean is about
    // proportional to the scale. So a scale is known to 1/√N, and the mean over the records to
    // 1/√(N · records). The bound is three times that, and what is left of a tenth, from which on a
    // scale is revised.
    const double known = 1 / std::sqrt(kSamples * kRecords);
    EXPECT_NEAR(noise / kNoise, ScaleOfEstimate(GetParam(), share), 3 * known + 0.03) << share;
    EXPECT_NEAR(std_dev / oracle, 1, 0.1) << share;
  }
}

TEST_P(GrossErrorsOrMisfit, FactorsAreThoseOfATruncatedNormalDistribution) {
  constexpr double kStep = 1e-4;
  double probability = 0, all = 0, others = 0;
  for (double u = 0.5 * kStep; u < 12; u += kStep) {
    const double weight = OutlierWeight(GetParam(), u);
    const double density = 2 * kStep * std::exp(-0.5 * u * u) / std::sqrt(2 * std::numbers::pi);
    all += density * weight * u * u;
    if (weight < kOutlierWeight) continue;
    probability += density;
    others += density * weight * u * u;
  }
  const double variance = VarianceFactor(GetParam());
  EXPECT_NEAR(DegreesFactor(GetParam()), all / variance, 1e-7);
  EXPECT_NEAR(InlierDegreesFactor(GetParam()), others / probability / variance, 1e-4);
  const double bounded = others / variance + (1 - probability) * OutlierDegrees(GetParam());
  EXPECT_NEAR(BoundedDegreesFactor(GetParam()), bounded, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(ByEveryMethod, GrossErrorsOrMisfit,
                         ::testing::Values(OutlierHandling::kStudentT, OutlierHandling::kHuber));

TEST(MayBeGrossErrors, IfTheyAreFewAndTheOthersFit) {
  for (const auto& [outliers, most] :
       {std::pair(OutlierHandling::kStudentT, 1.0 / 3), std::pair(OutlierHandling::kHuber, 0.15)}) {
    EXPECT_TRUE(MayBeGrossErrors(outliers, most, 200, 200));
    EXPECT_FALSE(MayBeGrossErrors(outliers, 1.01 * most, 200, 200));
    EXPECT_TRUE(MayBeGrossErrors(outliers, 0.1, 1199, 1000));
    EXPECT_FALSE(MayBeGrossErrors(outliers, 0.1, 1201, 1000));
    EXPECT_TRUE(MayBeGrossErrors(outliers, 0.1, 46, 25));  // 22 are four standard deviations
    EXPECT_FALSE(MayBeGrossErrors(outliers, 0.1, 48, 25));
  }
}

}  // namespace
}  // namespace polyest::internal::gross_errors_test
