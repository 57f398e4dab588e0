// Tests noise of unknown size, correlated noise and gross errors. The oracle is the same record
// estimated with its noise known. The standard deviation of a learned noise level is that of a
// sample variance, σ/√(2N), and of a learned lag-1 correlation √((1 − a²)/N).

#include "core/estimator/posterior/noise_learning.h"

#include <absl/strings/str_format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/bayes/noise.h"
#include "tests/testing/oscillator.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::noise_learning_test {
namespace {

using ::testing::HasSubstr;
using testing::kOscillatorNoise;
using testing::kOscillatorRate;

constexpr double kTrueK = 40.3, kTrueC = 0.21;

struct Disturbance {
  double correlation = 0;   // of the noise of successive samples
  double gross_errors = 0;  // the share of the samples
  double noise = kOscillatorNoise;
};

// Returns a record of the oscillator of this duration. Gross errors are up to ± the amplitude.
Samples Record(double duration_s, const Disturbance& disturbance, uint64_t seed = 2) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  Samples record;
  record.columns = {{"x", {}, {}}};
  const double a = disturbance.correlation;
  double e = normal(random);
  for (int k = 1; k <= duration_s * kOscillatorRate; ++k) {
    const double t = k / kOscillatorRate;
    e = a * e + std::sqrt(1 - a * a) * normal(random);
    const bool gross = uniform(random) < disturbance.gross_errors;
    record.time_s.push_back(t);
    record.columns[0].value.push_back(testing::OscillatorDisplacement(kTrueK, kTrueC, t) +
                                      (gross ? 2 * uniform(random) - 1 : disturbance.noise * e));
  }
  return record;
}

Problem ProblemWith(const NoiseModel& noise, bool adaptive = true) {
  Problem problem = testing::OscillatorProblem(3, adaptive);
  problem.measured = {{"x", noise}};
  return problem;
}

double TimeConstant(double correlation) { return -1 / kOscillatorRate / std::log(correlation); }

// Expects both parameters within `shift` standard deviations of the oracle's, and their standard
// deviations within `ratio`.
void ExpectNear(const Estimate& estimate, const Estimate& oracle, double shift, double ratio) {
  for (size_t i = 0; i < 2; ++i) {
    const ParameterEstimate& p = estimate.parameters[i];
    const ParameterEstimate& q = oracle.parameters[i];
    EXPECT_NEAR(p.map, q.map, shift * q.std_dev) << p.name;
    EXPECT_NEAR(p.std_dev / q.std_dev, 1, ratio) << p.name;
  }
}

TEST(UnknownScale, IsLearnedWithTheParameters) {
  const Samples record = Record(20, {});
  const Estimate known = EstimateOf(ProblemWith({.absolute = kOscillatorNoise}), record);
  const Estimate estimate = EstimateOf(ProblemWith({.unknown = true}), record);
  const auto samples = static_cast<double>(record.rows());
  EXPECT_NEAR(estimate.channels[0].noise_std_dev, kOscillatorNoise,
              3 / std::sqrt(2 * samples) * kOscillatorNoise);
  // The minimum under white noise does not depend on its scale; the uncertainty is proportional to
  // the scale found.
  ExpectNear(estimate, known, 0.03, 3 / std::sqrt(2 * samples));
  EXPECT_NEAR(estimate.channels[0].chi_squared, 400, 8);
  EXPECT_EQ(estimate.diagnostics.size(), 0u);
}

TEST(UnknownScale, IsAFactorOfTheNumbersGiven) {
  const Samples record = Record(20, {});
  const Estimate estimate =
      EstimateOf(ProblemWith({.absolute = 3 * kOscillatorNoise, .unknown = true}), record);
  EXPECT_NEAR(estimate.channels[0].noise_std_dev, kOscillatorNoise, 0.11 * kOscillatorNoise);
}

TEST(UnknownScale, IsFoundOverManyOrdersOfMagnitude) {
  for (const double noise : {1e-5, 0.3}) {
    const Estimate estimate =
        EstimateOf(ProblemWith({.unknown = true}), Record(20, {.noise = noise}));
    EXPECT_NEAR(estimate.channels[0].noise_std_dev / noise, 1, 0.11);
    EXPECT_NEAR(estimate.parameters[0].map, kTrueK, 4 * estimate.parameters[0].std_dev);
  }
}

// The uncertainty is the standard deviation of a Student's t with N − n of N degrees of freedom.
TEST(UnknownScale, WidensTheUncertaintyOfAShortRecord) {
  const Samples record = Record(1.5, {});
  const Estimate known = EstimateOf(ProblemWith({.absolute = kOscillatorNoise}), record);
  const Estimate estimate = EstimateOf(ProblemWith({.unknown = true}), record);
  const auto n = static_cast<double>(record.rows());
  const double t = std::sqrt(known.channels[0].chi_squared / (n - 2 - 2));
  ExpectNear(estimate, known, 0.05, 1);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(estimate.parameters[i].std_dev / (t * known.parameters[i].std_dev), 1, 0.02);
  }
}

TEST(UnknownScale, IsLearnedOnAFixedExpansionToo) {
  const Samples record = Record(2, {});
  const Estimate estimate = EstimateOf(ProblemWith({.unknown = true}, false), record);
  EXPECT_LT(estimate.channels[0].noise_std_dev, 2 * kOscillatorNoise);
}

TEST(UnknownScale, SaysThatItHasNotBeenLearnedFromFewSamples) {
  const Estimate estimate = EstimateOf(ProblemWith({.unknown = true}), Record(0.35, {}));
  EXPECT_THAT(Message(estimate, DiagnosticCode::kNoiseNotLearned),
              HasSubstr("too few samples (7), fewer than 8"));
  EXPECT_GT(estimate.channels[0].noise_std_dev, 1);  // about the size of the signal
  ExpectFinite(estimate);
}

// Noise is learned where windows end. Of an output that lacks every other sample there may be
// enough within one, and then that is said.
TEST(UnknownScale, SaysThatItWillBeLearnedWithMoreRows) {
  Problem problem = ProblemWith({.unknown = true});
  problem.measured.push_back({"v", {.unknown = true}});
  Samples record = Record(0.85, {});
  record.columns.push_back({"v", record.columns[0].value, {}});
  for (size_t row = 0; row < record.rows(); ++row) {
    record.columns[1].missing.push_back(row % 2 == 0);
  }
  const std::string message =
      Message(EstimateOf(problem, record), DiagnosticCode::kNoiseNotLearned);
  EXPECT_THAT(message,
              HasSubstr("output v: its noise has not been learned from its 8 samples yet"));
}

// Whatever the number of unknowns, and at whichever rows windows end otherwise.
TEST(UnknownScale, IsLearnedFromTheFewestSamplesThatSuffice) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  std::string output = "a0";
  std::vector<UncertainParameter> unknowns = {UncertainParameter::Normal("a0", 0, 10).value()};
  for (int n = 1; n <= 5; ++n) {
    Problem problem = TextProblem(output, unknowns, 1);
    problem.measured.front().noise = {.unknown = true};
    std::vector<double> values(static_cast<size_t>(MinSamplesForNoise(n)));
    for (double& value : values) value = 5 + normal(generator);
    const Estimate estimate = Processed(problem, values)->CurrentEstimate().value();
    EXPECT_FALSE(Has(estimate, DiagnosticCode::kNoiseNotLearned)) << n << " unknowns";
    const std::string name = "a" + std::to_string(n);
    output += absl::StrFormat(" + %s*cos(%d*t)", name, n);
    unknowns.push_back(UncertainParameter::Normal(name, 0, 10).value());
  }
}

TEST(UnknownScale, IsFoundInAnyUnit) {
  for (const double unit : {1e-9, 1e9}) {
    Samples record = Record(5, {});
    for (double& value : record.columns[0].value) value *= unit;
    Problem problem = ProblemWith({.unknown = true});
    problem.fixed["x0"] = unit;
    const Estimate estimate = EstimateOf(problem, record);
    const Estimate oracle = EstimateOf(ProblemWith({.unknown = true}), Record(5, {}));
    EXPECT_NEAR(estimate.channels[0].noise_std_dev / unit, oracle.channels[0].noise_std_dev,
                0.01 * oracle.channels[0].noise_std_dev);
    ExpectNear(estimate, oracle, 0.05, 0.03);
  }
}

TEST(UnknownScale, OfASignalThatIsZeroIsNotLearned) {
  Samples record = Record(3, {});
  for (double& value : record.columns[0].value) value = 0;
  Problem problem = ProblemWith({.unknown = true});
  problem.fixed["x0"] = 0;
  const Estimate estimate = EstimateOf(problem, record);
  ExpectFinite(estimate);
  EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kNotIdentified);
  EXPECT_THAT(Message(estimate, DiagnosticCode::kNoiseNotLearned), HasSubstr("all samples are 0"));
}

class NoiseThatIsLearned : public ::testing::TestWithParam<NoiseModel> {};

TEST_P(NoiseThatIsLearned, IsTheSameBitsForAnyBatches) {
  const Problem problem = ProblemWith(GetParam());
  const Samples record = Record(8, {.correlation = 0.5, .gross_errors = 0.02});
  const Estimate whole = testing::EstimateInBatches(problem, record, 1000);
  ExpectSame(testing::EstimateInBatches(problem, record, 7), whole);
}

INSTANTIATE_TEST_SUITE_P(OfEveryKind, NoiseThatIsLearned,
                         ::testing::Values(NoiseModel{.unknown = true},
                                           NoiseModel{.unknown = true,
                                                      .correlation = NoiseCorrelation::kUnknown},
                                           NoiseModel{.absolute = kOscillatorNoise,
                                                      .outliers = OutlierHandling::kStudentT},
                                           NoiseModel{.unknown = true,
                                                      .correlation = NoiseCorrelation::kUnknown,
                                                      .outliers = OutlierHandling::kHuber}));

TEST(CorrelatedNoise, WidensTheUncertaintyWhenItIsKnown) {
  const Samples record = Record(20, {.correlation = 0.8});
  const NoiseModel white{.absolute = kOscillatorNoise};
  NoiseModel correlated = white;
  correlated.correlation = NoiseCorrelation::kKnown;
  correlated.time_constant_s = TimeConstant(0.8);
  const Estimate overconfident = EstimateOf(ProblemWith(white), record);
  const Estimate estimate = EstimateOf(ProblemWith(correlated), record);
  EXPECT_THAT(Message(overconfident, DiagnosticCode::kCorrelatedResiduals), HasSubstr("0.8"));
  EXPECT_EQ(estimate.diagnostics.size(), 0u);
  // The power of the noise at the oscillator's frequency ω is (1 − a²)/(1 + a² − 2 a cos ωΔt) times
  // that of white noise: 2.6, with the root 1.6.
  // White noise is right for a white record, whose uncertainty is therefore not widened.
  const Estimate of_white = EstimateOf(ProblemWith(white), Record(20, {}));
  const double ratio = estimate.parameters[0].std_dev / of_white.parameters[0].std_dev;
  const double cosine = std::cos(std::sqrt(kTrueK) / kOscillatorRate);
  EXPECT_NEAR(ratio, std::sqrt(0.36 / (1 + 0.64 - 1.6 * cosine)), 0.05 * ratio);
  EXPECT_NEAR(estimate.channels[0].effective_samples, 400 * 0.2 / 1.8, 0.5);
}

TEST(CorrelatedNoise, IsLearnedWithItsSize) {
  const double a = 0.8;
  const Samples record = Record(20, {.correlation = a});
  NoiseModel known{.absolute = kOscillatorNoise};
  known.correlation = NoiseCorrelation::kKnown;
  known.time_constant_s = TimeConstant(a);
  const Estimate oracle = EstimateOf(ProblemWith(known), record);
  const Estimate estimate =
      EstimateOf(ProblemWith({.unknown = true, .correlation = NoiseCorrelation::kUnknown}), record);
  const double found = std::exp(-1 / kOscillatorRate / estimate.channels[0].noise_time_constant_s);
  EXPECT_NEAR(found, a, 3 * std::sqrt((1 - a * a) / 400));
  // The uncertainty follows the power of the noise at the oscillator's frequency. The innovations
  // are known to 1/√(2N) = 3.5 %, and |1 − a e^{iω}| to 3.8 % through the error of a. The bound is
  // three times both.
  ExpectNear(estimate, oracle, 0.15, 0.16);
}

TEST(CorrelatedNoise, IsTakenForWhiteWhileItIs) {
  const Samples record = Record(20, {});
  NoiseModel noise{.absolute = kOscillatorNoise};
  const Estimate white = EstimateOf(ProblemWith(noise), record);
  noise.correlation = NoiseCorrelation::kUnknown;
  const Estimate estimate = EstimateOf(ProblemWith(noise), record);
  // The correlation that is left at the end, r < 2/√N, is marginalized and changes the weights by
  // as much.
  ExpectNear(estimate, white, 0.1, 0.1);
}

class GrossErrors : public ::testing::TestWithParam<OutlierHandling> {};

// The record has 5 % of its samples replaced. Without help the estimate is off by many standard
// deviations.
TEST_P(GrossErrors, LeaveTheAnswerWhereItWas) {
  const Samples clean = Record(20, {});
  Samples record = clean;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int replaced = 0;
  for (size_t k = 7; k < record.rows(); k += 20, ++replaced) {
    record.columns[0].value[k] = uniform(random);
  }
  const NoiseModel plain{.absolute = kOscillatorNoise};
  NoiseModel robust = plain;
  robust.outliers = GetParam();
  const Estimate oracle = EstimateOf(ProblemWith(plain), clean);
  const Estimate misled = EstimateOf(ProblemWith(plain), record);
  const Estimate estimate = EstimateOf(ProblemWith(robust), record);
  EXPECT_GT(std::abs(misled.parameters[0].map - oracle.parameters[0].map),
            5 * oracle.parameters[0].std_dev);
  // The distance of an M-estimator of efficiency e from least squares on the same samples is √(1/e
  // − 1): 0.28 for Student's t, 0.23 for Huber. Huber is also pulled by the influence that the
  // gross errors keep.
  ExpectNear(estimate, oracle, GetParam() == OutlierHandling::kStudentT ? 0.84 : 1.5, 0.15);
  // The count also includes good samples with less than half their weight: |u| > √6 and |u| >
  // 2·1.345.
  const double good = 380 * (GetParam() == OutlierHandling::kStudentT ? 0.0143 : 0.0071);
  EXPECT_NEAR(static_cast<double>(estimate.channels[0].outliers), replaced + good,
              3 * std::sqrt(good) + 2);
}

INSTANTIATE_TEST_SUITE_P(ByEveryMethod, GrossErrors,
                         ::testing::Values(OutlierHandling::kStudentT, OutlierHandling::kHuber));

TEST(RecordWithoutGrossErrors, LosesLittleByLookingForThem) {
  const Samples record = Record(20, {});
  NoiseModel noise{.absolute = kOscillatorNoise};
  const Estimate plain = EstimateOf(ProblemWith(noise), record);
  noise.outliers = OutlierHandling::kStudentT;
  // The efficiency of 0.926 makes the standard deviation 4 % larger.
  ExpectNear(EstimateOf(ProblemWith(noise), record), plain, 0.84, 0.1);
}

TEST(NoiseModel, WeighsAsItsLossesAsk) {
  NoiseModel noise;
  EXPECT_EQ(OutlierWeight(noise.outliers, 1e9), 1);
  noise.outliers = OutlierHandling::kStudentT;
  EXPECT_EQ(OutlierWeight(noise.outliers, 0), 1.25);
  EXPECT_EQ(OutlierWeight(noise.outliers, 4), 0.25);
  noise.outliers = OutlierHandling::kHuber;
  EXPECT_EQ(OutlierWeight(noise.outliers, 1), 1);
  EXPECT_EQ(OutlierWeight(noise.outliers, -2.69), 0.5);
}

// A cosine at regular times is the same at a frequency and at its alias, so that only the prior
// prefers one. The noise must be that of the better minima: with a larger one the error of an
// expansion over both would seem small, and decide between them.
TEST(NoiseOfUnknownSize, LeavesAnAliasItsWeight) {
  constexpr double kStep = 0.574;  // s
  constexpr double kTruth = 1.008, kAlias = 1 / kStep - kTruth;
  constexpr double kMu = -0.517, kSigma = 0.2406;  // of the logarithm
  const double mean = std::exp(kMu + 0.5 * kSigma * kSigma);
  const auto frequency =
      UncertainParameter::Lognormal("f", mean, mean * std::sqrt(std::expm1(kSigma * kSigma)));
  const auto density = [](double f) {
    const double z = (std::log(f) - kMu) / kSigma;
    return std::exp(-0.5 * z * z) / f;
  };
  const double weight = density(kTruth) / (density(kTruth) + density(kAlias));
  // With 219 and 253 the sampler puts hardly a particle at the alias while the noise is learned.
  for (const uint64_t seed : {1, 2, 219, 253}) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, 0.03);
    Problem problem = TextProblem("cos(2*pi*f*t)", {*frequency}, 1);
    problem.measured[0].noise = {.unknown = true};
    Samples samples;
    samples.columns = {{"y", {}, {}}};
    for (int k = 1; k <= 32; ++k) {
      samples.time_s.push_back(k * kStep);
      samples.columns[0].value.push_back(std::cos(2 * M_PI * kTruth * k * kStep) + normal(random));
    }
    const Estimate estimate = EstimateOf(problem, samples);
    ASSERT_EQ(estimate.components.size(), 2u) << "seed " << seed;
    EXPECT_NEAR(estimate.components[1].weight, weight, 0.1 * weight) << "seed " << seed;
  }
}

TEST(ProblemOfUnknownNoise, RefusesACorrelationWithoutATimeConstant) {
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    const auto problem = ResolvedProblem::Make(ProblemWith(
        {.absolute = 1, .correlation = NoiseCorrelation::kKnown, .time_constant_s = bad}));
    EXPECT_EQ(problem.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(problem.status().message()),
                HasSubstr("measured[0].noise.correlation.time_constant_s: "));
  }
}

TEST(ProblemOfUnknownNoise, RefusesAWhiteShareThatIsNone) {
  NoiseModel noise{.absolute = 1, .correlation = NoiseCorrelation::kKnown, .time_constant_s = 1};
  for (const double bad : {-0.1, 1.0, std::nan("")}) {
    noise.white_share = bad;
    EXPECT_THAT(std::string(ResolvedProblem::Make(ProblemWith(noise)).status().message()),
                HasSubstr("measured[0].noise.correlation.white_share: "));
  }
  noise.white_share = 0.5;
  EXPECT_TRUE(ResolvedProblem::Make(ProblemWith(noise)).ok());
  for (const NoiseCorrelation other : {NoiseCorrelation::kWhite, NoiseCorrelation::kUnknown}) {
    noise.correlation = other;
    EXPECT_THAT(std::string(ResolvedProblem::Make(ProblemWith(noise)).status().message()),
                HasSubstr("white_share: 0.5 has no effect without timeConstantS"));
  }
}

}  // namespace
}  // namespace polyest::internal::noise_learning_test
