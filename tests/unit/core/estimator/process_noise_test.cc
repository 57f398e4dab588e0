// Tests estimates from the prediction errors of filters, for an oscillator that white force noise
// drives. The oracle is the exact likelihood (forced_oscillator.h).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/equation_model.h"
#include "polyest/experiment_design.h"
#include "tests/unit/core/estimator/forced_oscillator.h"

namespace polyest::internal::process_noise_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Maximum Maximize(const Samples& samples) {
  return Minimize([&](const Vector& at) { return ExactCost(samples, at); },
                  Vector{{kTrueK, kTrueC, std::log(kTrueQ)}}, Vector{{0.02, 0.004, 0.02}});
}

TEST(ProcessNoise, AgreesWithTheMaximumOfTheExactLikelihood) {
  const Samples samples = Measure(600, kTrueQ, 11);
  const Maximum exact = Maximize(samples);
  const Estimate estimate = EstimateOf(WithUnknownNoise(), samples);
  ASSERT_EQ(estimate.parameters.size(), 3u);
  EXPECT_EQ(estimate.parameters[2].name, "processNoise.v");
  EXPECT_EQ(estimate.parameters[2].unit, "(m/s)^2/s");
  for (int i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    EXPECT_NEAR(parameter.map, exact.at[i], 0.15 * exact.std_dev[i]) << parameter.name;
    EXPECT_NEAR(parameter.std_dev, exact.std_dev[i], 0.1 * exact.std_dev[i]) << parameter.name;
    EXPECT_EQ(parameter.verdict, Verdict::kIdentified);
  }
  EXPECT_NEAR(std::log(estimate.parameters[2].map), exact.at[2], 0.15 * exact.std_dev[2]);
  // The cost's mismatch is −log of the likelihood, to the discount for the expansion's own error:
  // one that may shift the estimate by half a standard deviation discounts the square of that.
  EXPECT_NEAR(estimate.cost.mismatch, exact.cost, 0.25);
}

// The force is streamed and holds its values; of 20 samples 7 are missing, in gaps and one by one.
TEST(ProcessNoise, FollowsStreamedInputsAndLeavesOutMissingSamples) {
  Samples samples = Measure(600, kTrueQ, 11);
  samples.columns.push_back({"force", {}, {}});
  // What a force of its own does is added to the samples.
  const Flow flow = FlowOf(kTrueK, kTrueC);
  Eigen::Vector2d forced(0, 0);
  for (size_t row = 0; row < samples.rows(); ++row) {
    samples.columns[1].value.push_back(std::sin(5 * samples.time_s[row]));
    forced = flow.whole * forced + ForceBefore(samples, row) * flow.force;
    samples.columns[0].value[row] += forced[0];
    samples.columns[0].missing.push_back(row % 20 < 5 || row % 10 == 7);
  }
  Problem problem = WithUnknownNoise();
  problem.inputs = {{"force", StreamedInput{.interpolation = Interpolation::kHold}}};
  const Maximum exact = Maximize(samples);
  const Estimate estimate = EstimateOf(problem, samples);
  EXPECT_EQ(estimate.samples, 390);
  for (int i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    EXPECT_NEAR(parameter.map, exact.at[i], 0.15 * exact.std_dev[i]) << parameter.name;
    EXPECT_NEAR(parameter.std_dev, exact.std_dev[i], 0.1 * exact.std_dev[i]) << parameter.name;
  }
  EXPECT_NEAR(std::log(estimate.parameters[2].map), exact.at[2], 0.15 * exact.std_dev[2]);
}

// Where the noise is a parameter, what is stated is a unit and no more. Ten times too much makes
// the logarithms of variances outweigh all squares.
TEST(ProcessNoise, DoesNotDependOnTheStatedNoiseWhereItIsAParameter) {
  const Samples samples = Measure(300, kTrueQ, 11);
  const auto estimate_of = [&](double stated) {
    Problem problem = ForcedOscillator();
    problem.process_noise = {{.state = "v", .spectral_density = kTrueQ}};
    problem.uncertain.push_back(UncertainParameter::Uniform("x.noise", 0.001, 0.02).value());
    problem.measured[0].noise.absolute = stated;
    problem.expansion.order = 9;  // order 6 may move a maximum by 0.08 standard deviations
    return EstimateOf(problem, samples);
  };
  const Estimate right = estimate_of(kSigma), large = estimate_of(10 * kSigma);
  EXPECT_LT(large.cost.mismatch, 0);
  for (size_t i = 0; i < 3; ++i) {
    const ParameterEstimate &a = right.parameters[i], &b = large.parameters[i];
    EXPECT_NEAR(b.map, a.map, 0.01 * a.std_dev) << a.name;
    EXPECT_NEAR(b.std_dev, a.std_dev, 0.01 * a.std_dev) << a.name;
    EXPECT_NEAR(b.mean, a.mean, 0.15 * a.std_dev) << a.name;
  }
}

TEST(ProcessNoise, RefusesBoundsThatNoPriorHas) {
  for (const auto& [lower, upper] :
       {std::pair{1e-120, 1.0}, {1.0, 1e120}, {1e-30, 1.0}, {1.0, 1.0 + 1e-12}}) {
    Problem problem = ForcedOscillator();
    problem.process_noise = {{.state = "v", .unknown = true, .lower = lower, .upper = upper}};
    EXPECT_THAT(std::string(Estimator::Make(problem).status().message()),
                HasSubstr("process_noise[0].lower: "))
        << lower;
  }
}

// The same record of two runs: the likelihood is the product of two, and standard deviations are
// those of twice as many samples.
TEST(ProcessNoise, BeginsAgainWithEachRun) {
  Samples samples = Measure(300, kTrueQ, 3);
  const Estimate once = EstimateOf(WithUnknownNoise(), samples);
  const size_t rows = samples.rows();
  samples.run.assign(rows, 0);
  for (size_t i = 0; i < rows; ++i) {
    samples.time_s.push_back(samples.time_s[i]);
    samples.columns[0].value.push_back(samples.columns[0].value[i]);
    samples.run.push_back(1);
  }
  const Estimate twice = EstimateOf(WithUnknownNoise(), samples);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(twice.parameters[i].map, once.parameters[i].map, 0.15 * once.parameters[i].std_dev);
    EXPECT_NEAR(twice.parameters[i].std_dev, once.parameters[i].std_dev / std::sqrt(2),
                0.1 * once.parameters[i].std_dev);
  }
}

// Each run has a damping of its own; the likelihood is the product of those of the runs.
TEST(ProcessNoise, KnowsParametersOfRuns) {
  const std::vector<Samples> runs = {Measure(300, kTrueQ, 3), Measure(300, kTrueQ, 4)};
  const Maximum exact = Minimize(
      [&](const Vector& at) {
        return ExactCost(runs[0], {at[0], at[1], at[3]}) +
               ExactCost(runs[1], {at[0], at[2], at[3]});
      },
      Vector{{kTrueK, kTrueC, kTrueC, std::log(kTrueQ)}}, Vector{{0.02, 0.004, 0.004, 0.02}});
  Samples samples = runs[0];
  samples.run.assign(300, 0);
  samples.run.resize(600, 1);
  samples.time_s.insert(samples.time_s.end(), runs[1].time_s.begin(), runs[1].time_s.end());
  samples.columns[0].value.insert(samples.columns[0].value.end(), runs[1].columns[0].value.begin(),
                                  runs[1].columns[0].value.end());
  Problem problem = WithUnknownNoise();
  problem.uncertain[1].per_run = true;
  const auto estimator = MakeEstimator(problem);
  ASSERT_TRUE(estimator->Append(samples).ok());
  ASSERT_TRUE(estimator->Process().ok());
  const Estimate estimate = estimator->CurrentEstimate().value();
  ASSERT_EQ(estimate.parameters.size(), 4u);
  const std::vector<std::pair<std::string, int>> places = {{"k", 0}, {"c[0]", 1}, {"c[1]", 2}};
  for (const auto& [name, place] : places) {
    const auto found = std::ranges::find(estimate.parameters, name, &ParameterEstimate::name);
    ASSERT_NE(found, estimate.parameters.end()) << name;
    EXPECT_NEAR(found->map, exact.at[place], 0.15 * exact.std_dev[place]) << name;
    EXPECT_NEAR(found->std_dev, exact.std_dev[place], 0.1 * exact.std_dev[place]) << name;
  }
  // Each run is predicted with its own damping: standardized residuals are white.
  PredictionOptions options;
  options.draws = 50;
  const auto prediction = estimator->CurrentPrediction(options);
  ASSERT_TRUE(prediction.ok()) << prediction.status();
  EXPECT_LT(prediction->outputs[0].score.autocorrelation.head(10).cwiseAbs().maxCoeff(),
            4 / std::sqrt(600));
}

double SquaredError(const Estimate& estimate) {
  double sum = 0;
  for (int i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    const double error = parameter.mean - (i == 0 ? kTrueK : kTrueC);
    sum += error * error / (parameter.std_dev * parameter.std_dev);
  }
  return sum;
}

// Six campaigns with k and c each: Σ (error ÷ standard deviation)² is a χ² of 12 degrees of
// freedom, which lies in 2.21 … 32.9 with the probability 0.998.
TEST(ProcessNoise, CoversTheTruth) {
  double sum = 0;
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    sum += SquaredError(EstimateOf(WithUnknownNoise(), Measure(300, kTrueQ, seed)));
  }
  EXPECT_GT(sum, 2.21);
  EXPECT_LT(sum, 32.9);
}

// Takes the model for perfect: the χ² of 10 degrees of freedom is above 29.6 with the probability
// 0.001.
TEST(ProcessNoise, MattersForWhatIsKnown) {
  double sum = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    sum += SquaredError(EstimateOf(ForcedOscillator(), Measure(300, kTrueQ, seed)));
  }
  EXPECT_GT(sum, 29.6);
}

// The filters follow the outputs exactly, so estimates differ by what random numbers do.
TEST(ProcessNoise, IsTheOutputErrorEstimateWithoutProcessNoise) {
  const Samples samples = Measure(400, 0, 5);
  const Estimate expected = EstimateOf(ForcedOscillator(), samples);
  Problem filtered = ForcedOscillator();
  filtered.likelihood = LikelihoodForm::kPredictionError;
  Problem tiny = ForcedOscillator();
  tiny.process_noise = {{.state = "v", .spectral_density = 1e-12}};
  for (const Problem& problem : {filtered, tiny}) {
    const Estimate estimate = EstimateOf(problem, samples);
    for (size_t i = 0; i < 2; ++i) {
      const ParameterEstimate& a = estimate.parameters[i];
      const ParameterEstimate& b = expected.parameters[i];
      EXPECT_NEAR(a.map, b.map, 0.15 * b.std_dev);
      EXPECT_NEAR(a.std_dev, b.std_dev, 0.05 * b.std_dev);
    }
    EXPECT_NEAR(estimate.channels[0].chi_squared, expected.channels[0].chi_squared, 0.05);
  }
}

TEST(ProcessNoise, DoesNotDependOnBatchesOrThreads) {
  const Samples samples = Measure(200, kTrueQ, 2);
  const Estimate expected = EstimateOf(WithUnknownNoise(), samples);
  EstimatorOptions options;
  options.threads = 2;
  const auto estimator = MakeEstimator(WithUnknownNoise(), options);
  for (size_t row = 0; row < samples.rows(); row += 7) {
    Samples batch;
    batch.columns = {{"x", {}, {}}};
    for (size_t i = row; i < std::min(row + 7, samples.rows()); ++i) {
      batch.time_s.push_back(samples.time_s[i]);
      batch.columns[0].value.push_back(samples.columns[0].value[i]);
    }
    ASSERT_TRUE(estimator->Append(batch).ok());
    ASSERT_TRUE(estimator->Process().ok());
  }
  ExpectSame(estimator->CurrentEstimate().value(), expected);
}

std::string RefusalOf(const Problem& problem) {
  return std::string(ResolvedProblem::Make(problem).status().message());
}

TEST(ProcessNoise, MustBeOfAStateAndHaveASize) {
  Problem problem = ForcedOscillator();
  problem.process_noise = {{.state = "w", .spectral_density = 1}};
  EXPECT_THAT(RefusalOf(problem),
              AllOf(HasSubstr("process_noise[0].state"), HasSubstr("has no state \"w\"")));
  problem.process_noise = {{.state = "v", .spectral_density = 1},
                           {.state = "v", .spectral_density = 2}};
  EXPECT_THAT(RefusalOf(problem), HasSubstr("process_noise[1].state: state v is given twice"));
  problem.process_noise = {{.state = "v", .spectral_density = -1}};
  EXPECT_THAT(RefusalOf(problem), HasSubstr("process_noise[0].spectral_density: -1 must be"));
  problem.process_noise = {{.state = "v", .unknown = true, .lower = 0, .upper = 1}};
  EXPECT_THAT(RefusalOf(problem), HasSubstr("process_noise[0].lower: 0 must be above 0"));
  problem.process_noise = {{.state = "v", .spectral_density = 1, .lower = 1, .upper = 2}};
  EXPECT_THAT(RefusalOf(problem), HasSubstr("have no effect without unknown"));
  problem.process_noise = {
      {.state = "v", .spectral_density = 1, .unknown = true, .lower = 1, .upper = 2}};
  EXPECT_THAT(RefusalOf(problem), HasSubstr("given although it is unknown"));
}

TEST(ProcessNoise, IsRefusedWithWhatFiltersCannotDo) {
  const auto refusal = [](const std::function<void(Problem&)>& change) {
    Problem problem = WithUnknownNoise();
    change(problem);
    return RefusalOf(problem);
  };
  EXPECT_THAT(refusal([](Problem& p) { p.likelihood = LikelihoodForm::kOutputError; }),
              HasSubstr("likelihood: OUTPUT_ERROR takes the model for perfect"));
  EXPECT_THAT(refusal([](Problem& p) { p.uncertain[0].population = true; }),
              HasSubstr("uncertain[0].population: is not available"));
  EXPECT_THAT(refusal([](Problem& p) { p.measured[0].noise.unknown = true; }),
              HasSubstr("measured[0].noise.unknown: is not available"));
  EXPECT_THAT(refusal([](Problem& p) { p.measured[0].noise.relative = 0.1; }),
              HasSubstr("measured[0].noise.relative: is not available"));
  EXPECT_THAT(refusal([](Problem& p) { p.measured[0].noise.outliers = OutlierHandling::kHuber; }),
              HasSubstr("measured[0].noise.outliers: HUBER is not available"));
  EXPECT_THAT(
      refusal([](Problem& p) { p.measured[0].noise.correlation = NoiseCorrelation::kUnknown; }),
      HasSubstr("measured[0].noise.correlation: is not available"));
  EXPECT_THAT(refusal([](Problem& p) { p.regularization_mode = RegularizationMode::kEvidence; }),
              HasSubstr("regularization_mode"));
  EXPECT_THAT(refusal([](Problem& p) { p.fixed["x.delay"] = 0.1; }),
              HasSubstr("likelihood: PREDICTION_ERROR is not available with a delay"));
  EXPECT_THAT(refusal([](Problem& p) {
                p.model = MakeEquationModel(
                              {.states = {{"v", "-sign(v) - k*v - c"}}, .outputs = {{"x", "v"}}})
                              .value();
                p.fixed = {};
              }),
              HasSubstr("whose equations do not switch"));
}

TEST(ProcessNoise, IsRefusedByStudiesOfAPerfectModel) {
  const Samples samples = Measure(50, kTrueQ, 2);
  const auto estimator = MakeEstimator(WithUnknownNoise());
  ASSERT_TRUE(estimator->Append(samples).ok());
  ASSERT_TRUE(estimator->Process().ok());
  EXPECT_THAT(std::string(estimator->CurrentRegularizationSweep({}).status().message()),
              HasSubstr("PREDICTION_ERROR is not available for a regularization sweep"));
  // The estimate as a prior would be that of a perfect model.
  Problem known = ForcedOscillator();
  known.process_noise = {{.state = "v", .spectral_density = kTrueQ}};
  EXPECT_THAT(
      std::string(WithEstimateAsPrior(known, EstimateOf(known, samples)).status().message()),
      HasSubstr("PREDICTION_ERROR is not available for a design after an estimate"));
}

}  // namespace
}  // namespace polyest::internal::process_noise_test
