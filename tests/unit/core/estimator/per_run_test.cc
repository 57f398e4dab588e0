// Tests parameters that each run has for itself. The oracle is linear: y = a t + b with a shared
// and b of each run, and with normal priors and noise. The posterior is that of least squares with
// the prior as additional rows.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "core/estimator/estimator_access.h"
#include "core/estimator/studies/cost_grid.h"
#include "core/estimator/studies/experiment_design.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kNoise = 0.2;

UncertainParameter PerRun(UncertainParameter parameter) {
  parameter.per_run = true;
  return parameter;
}

Problem LineProblem() {
  return TextProblem("a*t + b",
                     {PerRun(UncertainParameter::Normal("b", 1, 3).value()),
                      UncertainParameter::Normal("a", 0, 2).value()},
                     kNoise);
}

// Returns samples of lines of slope 0.7 with offsets 2, −3 and 4.
Samples ThreeLines() {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal(0, kNoise);
  const double offsets[] = {2, -3, 4};
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int run = 0; run < 3; ++run) {
    for (int k = 0; k < 9 - 2 * run; ++k) {
      samples.run.push_back(run);
      samples.time_s.push_back(0.5 * k);
      samples.columns[0].value.push_back(0.7 * samples.time_s.back() + offsets[run] +
                                         normal(generator));
    }
  }
  return samples;
}

struct Exact {
  Vector mean;
  Matrix covariance;
};

// Returns the posterior of b[0], a, b[1], b[2].
Exact LeastSquaresWithPrior(const Samples& samples) {
  const int place[] = {0, 2, 3};
  Matrix information = Vector{{1.0 / 9, 1.0 / 4, 1.0 / 9, 1.0 / 9}}.asDiagonal();
  Vector right = Vector{{1.0 / 9, 0, 1.0 / 9, 1.0 / 9}};
  for (size_t k = 0; k < samples.rows(); ++k) {
    Vector row = Vector::Zero(4);
    row[1] = samples.time_s[k];
    row[place[samples.run[k]]] = 1;
    information += row * row.transpose() / (kNoise * kNoise);
    right += row * samples.columns[0].value[k] / (kNoise * kNoise);
  }
  const Eigen::LLT<Matrix> factor(information);
  return {factor.solve(right), factor.solve(Matrix::Identity(4, 4))};
}

std::vector<std::string> NamesOf(const Estimate& estimate) {
  std::vector<std::string> names;
  for (const ParameterEstimate& parameter : estimate.parameters) names.push_back(parameter.name);
  return names;
}

TEST(PerRun, AgreesWithLeastSquaresOverAllRuns) {
  const Samples samples = ThreeLines();
  const Exact exact = LeastSquaresWithPrior(samples);
  const Estimate estimate = EstimateOf(LineProblem(), samples);
  ASSERT_THAT(NamesOf(estimate), ElementsAre("b[0]", "a", "b[1]", "b[2]"));
  for (int i = 0; i < 4; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    SCOPED_TRACE(parameter.name);
    const double std_dev = std::sqrt(exact.covariance(i, i));
    // The expansion of a linear output is exact up to the rounding of its fit. Its residual adds
    // that rounding to the noise.
    EXPECT_NEAR(parameter.map, exact.mean[i], 1e-4 * std_dev);
    EXPECT_NEAR(parameter.std_dev, std_dev, 1e-4 * std_dev);
    EXPECT_NEAR(parameter.mean, exact.mean[i], 0.03 * std_dev);
    EXPECT_EQ(parameter.prior_mean, parameter.name == "a" ? 0 : 1);
  }
  EXPECT_NEAR(estimate.covariance(2, 3), exact.covariance(2, 3), 1e-4 * exact.covariance(2, 2));
}

TEST(PerRun, HowARecordIsCutIntoBatchesDoesNotMatter) {
  const Samples all = ThreeLines();
  const Estimate whole = EstimateOf(LineProblem(), all);
  const auto estimator = MakeEstimator(LineProblem());
  for (size_t k = 0; k < all.rows(); ++k) {
    Samples row;
    row.time_s = {all.time_s[k]};
    row.run = {all.run[k]};
    row.columns = {{"y", {all.columns[0].value[k]}, {}}};
    ASSERT_TRUE(estimator->Append(row).ok());
    ASSERT_TRUE(estimator->Process().ok());
    const Estimate estimate = estimator->CurrentEstimate().value();
    ASSERT_EQ(estimate.parameters.size(), static_cast<size_t>(2 + all.run[k]));
  }
  ExpectSame(estimator->CurrentEstimate().value(), whole);
}

// The rows of a new run may be appended long before they are processed.
TEST(PerRun, AnswersAreOfTheRunsThatHaveBeenProcessed) {
  Samples first = ThreeLines(), second = first;
  const auto cut = [](Samples& samples, size_t from, size_t to) {
    const auto part = [&](auto& values) {
      values = std::decay_t<decltype(values)>(values.begin() + from, values.begin() + to);
    };
    part(samples.time_s);
    part(samples.run);
    part(samples.columns[0].value);
  };
  cut(first, 0, 9);
  cut(second, 9, 12);
  const auto estimator = MakeEstimator(LineProblem());
  ASSERT_TRUE(estimator->Append(first).ok());
  ASSERT_TRUE(estimator->Process().ok());
  const Posterior posterior = estimator->CurrentPosterior({}).value();
  const Prediction prediction = estimator->CurrentPrediction({}).value();
  const CostProfiles profiles = estimator->CurrentProfiles({}).value();
  const RegularizationSweep sweep = estimator->CurrentRegularizationSweep({}).value();
  ASSERT_TRUE(estimator->Append(second).ok());
  const Posterior after = estimator->CurrentPosterior({}).value();
  ASSERT_EQ(after.marginals.size(), 2u);
  EXPECT_EQ(after.marginals[0].quantiles, posterior.marginals[0].quantiles);
  EXPECT_EQ(estimator->CurrentPrediction({})->outputs[0].mean, prediction.outputs[0].mean);
  EXPECT_EQ(estimator->CurrentProfiles({})->profiles.size(), profiles.profiles.size());
  EXPECT_EQ(estimator->CurrentRegularizationSweep({})->points.size(), sweep.points.size());
  ASSERT_TRUE(estimator->Process().ok());
  EXPECT_EQ(estimator->CurrentPosterior({})->marginals.size(), 3u);
}

TEST(PerRun, ManyRunsRefuseWhatWouldBeTooManyParameters) {
  Problem problem = LineProblem();
  problem.expansion.adaptive = false;  // runs that have ended cannot be eliminated
  const auto estimator = MakeEstimator(problem);
  EXPECT_EQ(EstimatorAccess::ProblemOf(*estimator).max_runs(),
            11);  // a and 11 values of b make 12.
  Samples samples;
  samples.time_s = {0, 0};
  samples.run = {0, 11};
  samples.columns = {{"y", {1, 1}, {}}};
  const absl::Status refused = estimator->Append(samples);
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()),
              HasSubstr("row 1 (counted from 0), column run: 11 must be below 11"));
  EXPECT_EQ(estimator->rows_appended(), 0);
  samples.run = {0, 10};
  EXPECT_TRUE(estimator->Append(samples).ok());
  EXPECT_EQ(EstimatorAccess::ProblemOf(*estimator).dimension(), 12);
}

TEST(PerRun, RunsThatShareNothingAreNotEliminated) {
  Problem problem = LineProblem();
  problem.uncertain[1].per_run = true;
  EXPECT_EQ(ResolvedProblem::Make(problem)->max_runs(), 6);
}

TEST(PerRun, AnAdaptiveExpansionHasNoLimit) {
  const ResolvedProblem problem = ResolvedProblem::Make(LineProblem()).value();
  EXPECT_GT(problem.max_runs(), 1'000'000);
  EXPECT_EQ(problem.max_joint_runs(), 11);
  EXPECT_EQ(problem.AtRun(10)->dimension(), 12);
  EXPECT_THAT(problem.AtRun(11)->prior().Names(), ElementsAre("b[11]", "a"));
}

TEST(PerRun, WithoutThemRunsAreUnlimited) {
  Problem problem = LineProblem();
  problem.uncertain[0].per_run = false;
  EXPECT_GT(ResolvedProblem::Make(problem)->max_runs(), 1'000'000);
}

TEST(PerRun, ACorrelationIsOfParametersOfOneKind) {
  Problem problem = LineProblem();
  problem.correlations = {{"a", "b", 0.5}};
  const auto refused = ResolvedProblem::Make(problem);
  EXPECT_THAT(std::string(refused.status().message()),
              HasSubstr("correlations[0]: only one of a and b is per run"));
  problem.uncertain[1].per_run = true;
  const ResolvedProblem both = ResolvedProblem::Make(problem, 2).value();
  // The rows of F F^T belong to b[0], a[0], b[1], a[1].
  const Matrix correlation = both.prior().factor() * both.prior().factor().transpose();
  EXPECT_NEAR(correlation(0, 1), 0.5, 1e-12);
  EXPECT_NEAR(correlation(2, 3), 0.5, 1e-12);
  EXPECT_NEAR(correlation(0, 3), 0, 1e-12);
}

TEST(PerRun, ThePosteriorOfALaterRunCanBeAskedFor) {
  const auto estimator = MakeEstimator(LineProblem());
  ASSERT_TRUE(estimator->Append(ThreeLines()).ok());
  ASSERT_TRUE(estimator->Process().ok());
  const auto profiles = estimator->CurrentProfiles({.parameters = {"b[2]"}});
  ASSERT_TRUE(profiles.ok()) << profiles.status();
  const auto unknown = estimator->CurrentProfiles({.parameters = {"b"}});
  EXPECT_EQ(unknown.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(PerRun, TheNextExperimentKnowsOnlyWhatIsShared) {
  const Samples samples = ThreeLines();
  const ResolvedProblem problem = ResolvedProblem::Make(LineProblem()).value();
  const ResolvedProblem next =
      WithEstimateAsPrior(problem, EstimateOf(LineProblem(), samples)).value();
  const Exact exact = LeastSquaresWithPrior(samples);
  EXPECT_NEAR(next.prior().StandardDeviation()[0], 3, 1e-12);  // of b
  EXPECT_NEAR(next.prior().StandardDeviation()[1], std::sqrt(exact.covariance(1, 1)), 1e-4);
}

// The data do not tell the sign of a, and no expansion over both signs follows exp(−a² t) within so
// little noise. Each sign has an expansion of its own, which then takes the runs that follow.
TEST(PerRun, ThePiecesOfAPosteriorTakeNewRunsEach) {
  Problem problem = TextProblem("exp(-a^2*t) + b",
                                {UncertainParameter::Uniform("a", -2, 2).value(),
                                 PerRun(UncertainParameter::Normal("b", 0, 1).value())},
                                0.002);
  const double offsets[] = {0.3, -0.4, 1.1};
  std::mt19937_64 generator(11);
  std::normal_distribution<double> normal(0, 0.002);
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int run = 0; run < 3; ++run) {
    for (int k = 1; k <= 20; ++k) {
      samples.run.push_back(run);
      samples.time_s.push_back(0.1 * k);
      samples.columns[0].value.push_back(std::exp(-0.81 * samples.time_s.back()) + offsets[run] +
                                         normal(generator));
    }
  }
  const Estimate estimate = EstimateOf(problem, samples);
  ASSERT_EQ(estimate.components.size(), 2);
  for (const ComponentEstimate& piece : estimate.components) {
    EXPECT_NEAR(piece.weight, 0.5, 0.02);
    ASSERT_EQ(piece.parameters.size(), 4);
    EXPECT_NEAR(std::abs(piece.parameters[0].map), 0.9, 4 * piece.parameters[0].std_dev);
    for (int run = 0; run < 3; ++run) {
      const ParameterEstimate& b = piece.parameters[static_cast<size_t>(1 + run)];
      EXPECT_NEAR(b.map, offsets[run], 4 * b.std_dev) << b.name;
      EXPECT_LT(b.contraction, 0.01) << b.name;
    }
  }
}

// What was estimated of a run serves for its other rows. The oracle is linear, for joint runs.
TEST(PerRun, OtherRowsOfTheSameRunsArePredictedAsTheyAre) {
  const Samples samples = ThreeLines();
  const Exact exact = LeastSquaresWithPrior(samples);
  const auto estimator = MakeEstimator(LineProblem());
  ASSERT_TRUE(estimator->Append(samples).ok());
  ASSERT_TRUE(estimator->Process().ok());
  PredictionOptions options;
  options.record.emplace();
  options.record->time_s = {6, 6, 6};
  options.record->run = {0, 1, 2};
  options.record->columns = {{"y", {0, 0, 0}, {}}};
  options.draws = 2'000;
  const Prediction prior = estimator->CurrentPrediction(options).value();
  options.same_runs = true;
  const Prediction own = estimator->CurrentPrediction(options).value();
  const int place[] = {0, 2, 3};
  for (int run = 0; run < 3; ++run) {
    Vector row = Vector::Zero(4);
    row[1] = 6;
    row[place[run]] = 1;
    const double std_dev = std::sqrt(row.dot(exact.covariance * row));
    EXPECT_NEAR(own.outputs[0].mean[run], row.dot(exact.mean), 0.1 * std_dev);
    EXPECT_NEAR(own.outputs[0].std_dev[run], std_dev, 0.1 * std_dev);
    EXPECT_GT(prior.outputs[0].std_dev[run], 2.5);  // b has the standard deviation 3
  }
  options.record.reset();
  EXPECT_THAT(std::string(estimator->CurrentPrediction(options).status().message()),
              HasSubstr("same_runs: true needs a record"));
}

// Lines of slope 0.7 with noise of 0.3 that is correlated over two samples.
Samples CorrelatedLines(int runs) {
  std::mt19937_64 generator(9);
  std::normal_distribution<double> normal(0, 1);
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  const double a = std::exp(-0.5);
  for (int run = 0; run < runs; ++run) {
    const double offset = normal(generator);
    double noise = normal(generator);
    for (int k = 0; k < 40; ++k) {
      samples.run.push_back(run);
      samples.time_s.push_back(0.1 * k);
      samples.columns[0].value.push_back(0.7 * samples.time_s.back() + offset + 0.3 * noise);
      noise = a * noise + std::sqrt(1 - a * a) * normal(generator);
    }
  }
  return samples;
}

// Only the runs that are not eliminated tell of other time constants of the noise, and must not be
// taken for all.
TEST(PerRun, TheNoiseOfEliminatedRunsIsNotJudgedByTheLastOne) {
  Problem problem = LineProblem();
  problem.measured[0].noise = {.unknown = true, .correlation = NoiseCorrelation::kUnknown};
  const Estimate estimate = EstimateOf(problem, CorrelatedLines(16));
  const ParameterEstimate& a = estimate.parameters[1];
  ASSERT_EQ(a.name, "a");
  // Of 16 runs of 40 samples with 2 sums of noise each: 0.3 √(2 · 2 / (640 · 1.33)) = 0.02.
  EXPECT_NEAR(a.std_dev, 0.02, 0.01);
  EXPECT_NEAR(a.mean, 0.7, 4 * a.std_dev);
  EXPECT_NEAR(a.mean, a.map, 0.5 * a.std_dev);
  EXPECT_GT(a.upper95 - a.lower95, 2.5 * a.std_dev);

  // Other rows of runs that have been eliminated are predicted, too.
  const auto estimator = MakeEstimator(problem);
  ASSERT_TRUE(estimator->Append(CorrelatedLines(16)).ok());
  ASSERT_TRUE(estimator->Process().ok());
  PredictionOptions options;
  options.record.emplace();
  for (int run = 0; run < 10; ++run) {
    options.record->time_s.push_back(4);
    options.record->run.push_back(run);
  }
  options.record->columns = {{"y", std::vector<double>(10, 0), {}}};
  options.same_runs = true;
  const Prediction prediction = estimator->CurrentPrediction(options).value();
  EXPECT_LT(prediction.outputs[0].std_dev.maxCoeff(), 0.5);
}

// The oracle is −log of the posterior density: a parabola along any line, with the curvature 1/σ²
// of the conditional density.
TEST(PerRun, TheCostGridRunsEachRunWithItsOwn) {
  const Samples samples = ThreeLines();
  CostGridOptions options;
  options.parameters = {"b[2]"};
  options.points = 11;
  const auto grid =
      EvaluateCostGrid(ResolvedProblem::Make(LineProblem()).value(), samples, options, {});
  ASSERT_TRUE(grid.ok()) << grid.status();
  EXPECT_THAT(grid->units, ElementsAre(""));
  const double step = grid->axes[0][6] - grid->axes[0][5];
  const double information = 1.0 / 9 + 5 / (kNoise * kNoise);  // Run 2 has five samples.
  EXPECT_NEAR(grid->total(4, 0) - 2 * grid->total(5, 0) + grid->total(6, 0),
              information * step * step, 1e-6 * information * step * step);
}

}  // namespace
}  // namespace polyest::internal
