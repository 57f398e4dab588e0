// Tests records of real hardware whose noise is unknown. The oracles are the results of others, who
// chose the noise themselves (the residuals in pixels and mrad, g/L = 1.3556).

#include <gtest/gtest.h>

#include <cmath>

#include "polyest/catalogue.h"
#include "polyest/estimator.h"
#include "tests/testing/records.h"
#include "tests/testing/two_gliders.h"

namespace polyest::internal::real_noise_test {
namespace {

using testing::EstimateInBatches;
using testing::SharedRecord;

constexpr NoiseModel kUnknown{.unknown = true};
constexpr NoiseModel kUnknownAndCorrelated{.unknown = true,
                                           .correlation = NoiseCorrelation::kUnknown};

bool Has(const Estimate& estimate, DiagnosticCode code) {
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    if (diagnostic.code == code) return true;
  }
  return false;
}

// The estimate starts cold, with broad priors.
TEST(TwoGlidersRecordNoise, HasTheResidualsThatOthersFound) {
  const auto record = SharedRecord("air_track_2mass.csv", {"x1", "x2"});
  if (!record) GTEST_SKIP() << "../shared/data/air_track_2mass.csv is not there";
  Problem problem = testing::TwoGlidersProblem(2);
  for (MeasuredOutput& measured : problem.measured) measured.noise = kUnknown;
  const Estimate estimate = EstimateInBatches(problem, *record, 1000);
  // Others state the root mean square of the residuals. The noise is larger by what the fit takes
  // up: 6 parameters of 495 samples to a channel, and as much again for the spread of the draws.
  const double others[] = {0.62, 0.59};
  for (size_t i = 0; i < 2; ++i) {
    const ChannelEstimate& channel = estimate.channels[i];
    const double mean_square = channel.chi_squared / static_cast<double>(channel.samples);
    EXPECT_NEAR(channel.noise_std_dev * std::sqrt(mean_square), others[i], 0.01);
    EXPECT_GT(mean_square, 1 - 2 * 6 / 495.0);
    EXPECT_LE(mean_square, 1);
  }
  EXPECT_TRUE(Has(estimate, DiagnosticCode::kCorrelatedResiduals));
}

TEST(TwoGlidersRecordNoise, GivesTheSameWithCorrelatedNoiseInAWiderInterval) {
  const auto record = SharedRecord("air_track_2mass.csv", {"x1", "x2"});
  if (!record) GTEST_SKIP() << "../shared/data/air_track_2mass.csv is not there";
  Problem problem = testing::TwoGlidersProblem(2);
  for (MeasuredOutput& measured : problem.measured) measured.noise = kUnknownAndCorrelated;
  const Estimate estimate = EstimateInBatches(problem, *record, 1000);
  const double least_squares[] = {7.7794, 77.9865, 31.4721, 3.11865};
  for (size_t i = 0; i < 4; ++i) {
    const ParameterEstimate& p = estimate.parameters[i];
    EXPECT_NEAR(p.map, least_squares[i], p.std_dev) << p.name;
  }
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kCorrelatedResiduals));
  EXPECT_LT(estimate.channels[0].effective_samples, 250);  // of 495
}

Problem PendulumProblem(const NoiseModel& noise) {
  Problem problem;
  problem.model = *FindBuiltinModel("pendulum");
  const auto uniform = [&](const char* name, double lower, double upper) {
    problem.uncertain.push_back(*UncertainParameter::Uniform(name, lower, upper));
  };
  uniform("g_over_l", 1.1, 1.6);
  uniform("c", 0, 0.05);
  uniform("c2", 0, 0.05);
  uniform("theta0", 0.9, 1.4);
  uniform("omega0", 0, 2);
  uniform("theta.offset", -0.1, 0.1);
  problem.measured = {{"theta", noise}};
  problem.expansion.order = 2;
  return problem;
}

TEST(PendulumRecordNoise, HasTheResidualThatOthersFound) {
  const auto record = SharedRecord("pendulum.csv", {"theta"});
  if (!record) GTEST_SKIP() << "../shared/data/pendulum.csv is not there";
  const Estimate estimate = EstimateInBatches(PendulumProblem(kUnknown), *record, 1000);
  EXPECT_NEAR(estimate.channels[0].noise_std_dev, 0.0106, 0.0002);
}

TEST(PendulumRecordNoise, HasThePublishedValueWithinItsIntervalHoweverItArrives) {
  const auto record = SharedRecord("pendulum.csv", {"theta"});
  if (!record) GTEST_SKIP() << "../shared/data/pendulum.csv is not there";
  const Problem problem = PendulumProblem(kUnknownAndCorrelated);
  const Estimate at_once = EstimateInBatches(problem, *record, 1000);
  const Estimate streamed = EstimateInBatches(problem, *record, 20);
  EXPECT_LT(at_once.parameters[0].lower95, 1.3556);
  EXPECT_GT(at_once.parameters[0].upper95, 1.3556);
  EXPECT_LT(at_once.parameters[0].std_dev, 0.0007);
  EXPECT_EQ(streamed.parameters[0].map, at_once.parameters[0].map);
  EXPECT_EQ(streamed.parameters[0].lower95, at_once.parameters[0].lower95);
}

}  // namespace
}  // namespace polyest::internal::real_noise_test
