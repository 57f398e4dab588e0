// Records of a cosine at irregular times, of which few determine its frequency well enough for the
// first search to end in the right one of the many minima.

#include "core/estimator/second_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::second_search_test {
namespace {

constexpr double kNoise = 0.1;

struct CosineRecord {
  double frequency = 0;
  Samples samples;
};

CosineRecord RecordOf(uint64_t seed) {
  std::mt19937_64 generator(seed);
  const auto uniform = [&](double lower, double upper) {
    return lower + (upper - lower) * std::generate_canonical<double, 53>(generator);
  };
  CosineRecord record;
  record.frequency = uniform(0.7, 5.3);
  record.samples.columns = {{"y", {}, {}}};
  for (int k = 0; k < 60; ++k) record.samples.time_s.push_back(uniform(0, 40));
  std::ranges::sort(record.samples.time_s);
  for (const double t : record.samples.time_s) {
    // Box and Muller, so that the record does not depend on the library's distributions.
    const double normal = std::sqrt(-2 * std::log(1 - uniform(0, 1))) *
                          std::cos(2 * std::numbers::pi * uniform(0, 1));
    record.samples.columns[0].value.push_back(
        std::cos(2 * std::numbers::pi * record.frequency * t) + kNoise * normal);
  }
  return record;
}

Problem CosineProblem() {
  return TextProblem("cos(2*pi*f*t)", {*UncertainParameter::Uniform("f", 0.5, 5.5)}, kNoise);
}

// Without a second search these records end in a false minimum, with residuals of several times the
// noise. The truth is the oracle: with 60 samples the next minimum is worse by hundreds of nats.
TEST(SecondSearch, LeavesAFalseMinimum) {
  for (const uint64_t seed : {5, 33}) {
    const CosineRecord record = RecordOf(seed);
    const Estimate estimate = EstimateOf(CosineProblem(), record.samples);
    const ParameterEstimate& f = estimate.parameters[0];
    EXPECT_NEAR(f.map, record.frequency, 5 * f.std_dev) << seed;
    EXPECT_LT(f.std_dev, 1e-3) << seed;
    EXPECT_FALSE(Has(estimate, DiagnosticCode::kModelMisfit)) << seed;
  }
}

// Frequencies that the prior holds for improbable, 2.7 to 3.9 of its standard deviations from its
// mean in units of normal scores: its own polynomials do not follow the model there. Eight samples
// of half a period or more leave no doubt; the truth is the oracle.
TEST(SecondSearch, FindsWhatIsInThePriorsTails) {
  const Problem problem =
      TextProblem("cos(w*t)", {*UncertainParameter::Beta("w", 2, 40, 0, 100)}, kNoise / 2);
  for (const double frequency : {18.0, 21.0, 24.0, 28.0}) {
    Samples samples;
    samples.columns = {{"y", {}, {}}};
    for (int k = 1; k <= 8; ++k) {
      samples.time_s.push_back(0.05 * k);
      const double error = (k % 3 - 1) * kNoise / 2;
      samples.columns[0].value.push_back(std::cos(frequency * 0.05 * k) + error);
    }
    const Estimate estimate = EstimateOf(problem, samples);
    const ParameterEstimate& w = estimate.parameters[0];
    EXPECT_NEAR(w.map, frequency, 4 * w.std_dev) << frequency;
    EXPECT_LT(w.std_dev, 0.2) << frequency;
    EXPECT_FALSE(Has(estimate, DiagnosticCode::kModelMisfit)) << frequency;
  }
}

// Where nothing better is to be found, the misfit stays and is said.
TEST(SecondSearch, KeepsWhatItCannotBetter) {
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int k = 1; k <= 60; ++k) {
    samples.time_s.push_back(0.1 * k);
    samples.columns[0].value.push_back(k % 2 == 0 ? 2 : -2);
  }
  const Estimate estimate =
      EstimateOf(TextProblem("a", {*UncertainParameter::Uniform("a", -3, 3)}, kNoise), samples);
  EXPECT_TRUE(Has(estimate, DiagnosticCode::kModelMisfit));
  EXPECT_NEAR(estimate.parameters[0].map, 0, 1e-6);
}

}  // namespace
}  // namespace polyest::internal::second_search_test
