#include "polyest/prediction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/bayes/predictive_density.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::prediction_test {
namespace {

constexpr double kNoise = 0.2;
constexpr int kDraws = 4000;

// A line with normal priors, for which everything is Gaussian: θ | z ~ N(μ, C) with
// C = (Λ + HᵀH/σ²)⁻¹, μ = C Hᵀz/σ², and an output hᵀθ ~ N(hᵀμ, hᵀC h).
struct Line {
  explicit Line(const std::vector<double>& time_s, const std::vector<double>& values) {
    Eigen::Matrix2d precision = Eigen::Matrix2d::Identity();
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (size_t k = 0; k < values.size(); ++k) {
      const Eigen::Vector2d h(1, time_s[k]);
      precision += h * h.transpose() / (kNoise * kNoise);
      sum += h * values[k] / (kNoise * kNoise);
    }
    covariance = precision.inverse();
    mean = covariance * sum;
  }
  double Mean(double t) const { return mean[0] + mean[1] * t; }
  double StdDev(double t) const {
    const Eigen::Vector2d h(1, t);
    return std::sqrt(h.dot(covariance * h));
  }
  double SampleStdDev(double t) const { return std::hypot(StdDev(t), kNoise); }

  Eigen::Matrix2d covariance;
  Eigen::Vector2d mean;
};

Problem LineProblem() {
  return TextProblem("a + b*t",
                     {UncertainParameter::Normal("a", 0, 1).value(),
                      UncertainParameter::Normal("b", 0, 1).value()},
                     kNoise);
}

const std::vector<double> kValues = {1.1, 1.4, 2.3, 2.2, 3.0, 3.6, 3.8, 4.9};
const std::vector<double> kTimes = {1, 2, 3, 4, 5, 6, 7, 8};

Prediction PredictionOf(const Estimator& estimator, const PredictionOptions& options) {
  absl::StatusOr<Prediction> prediction = estimator.CurrentPrediction(options);
  EXPECT_TRUE(prediction.ok()) << prediction.status();
  return *std::move(prediction);
}

TEST(PredictiveDensity, OfOneDrawIsTheKernel) {
  const Vector y = Vector::Constant(1, 3), s = Vector::Constant(1, 0.5);
  const PredictiveDensity normal(NoiseKernel::kNormal, y, s);
  EXPECT_NEAR(normal.Quantile(0.975), 3 + 0.5 * 1.959963985, 1e-6);
  EXPECT_NEAR(normal.Cumulative(3.5), 0.841344746, 1e-9);
  EXPECT_NEAR(normal.LogDensity(3), -std::log(0.5 * std::sqrt(2 * std::numbers::pi)), 1e-12);
  // Tables of Student's t with 4 degrees of freedom.
  const PredictiveDensity student(NoiseKernel::kStudentT, y, s);
  EXPECT_NEAR(student.Quantile(0.975), 3 + 0.5 * 2.776445105, 1e-6);
  EXPECT_NEAR(student.Quantile(0.005), 3 - 0.5 * 4.604094871, 1e-6);
  EXPECT_NEAR(student.StandardDeviation(), 0.5 * std::numbers::sqrt2, 1e-12);
  EXPECT_NEAR(std::exp(student.LogDensity(3)), 0.375 / 0.5, 1e-12);
}

TEST(PredictiveDensity, FindsQuantilesBetweenFarDraws) {
  const Vector y{{-50, 0, 50}}, s{{0.1, 1, 10}};
  const PredictiveDensity density(NoiseKernel::kNormal, y, s);
  for (const double p : {1e-6, 0.1, 0.33, 0.34, 0.5, 0.7, 1 - 1e-6}) {
    EXPECT_NEAR(density.Cumulative(density.Quantile(p)), p, 1e-5);
  }
  EXPECT_NEAR(density.LogDensity(1e4),
              -0.5 * 995 * 995 - std::log(30 * std::sqrt(2 * std::numbers::pi)),
              1e-6);  // where the density underflows
}

// With ν degrees of freedom, a normal of unknown variance is Student's t: its 97.5 % quantile is
// 2.228 for ν = 10 and 2.571 for ν = 5.
TEST(PredictiveDensity, WithAnEstimatedScaleIsStudentsT) {
  const Vector y = Vector::Zero(kDraws);
  const Vector ten = ScaleFactors(10, kDraws), five = ScaleFactors(5, kDraws);
  EXPECT_NEAR(PredictiveDensity(NoiseKernel::kNormal, y, ten).Quantile(0.975), 2.228139, 1e-3);
  EXPECT_NEAR(PredictiveDensity(NoiseKernel::kNormal, y, five).Quantile(0.975), 2.570582, 2e-3);
}

TEST(Prediction, OfALinearProblemIsTheGaussianOne) {
  const auto estimator = Processed(LineProblem(), kValues);
  const Line exact(kTimes, kValues);
  PredictionOptions options;
  options.draws = kDraws;
  const Prediction prediction = PredictionOf(*estimator, options);
  ASSERT_EQ(prediction.rows.size(), kValues.size());
  ASSERT_EQ(prediction.outputs.size(), 1u);
  const PredictedOutput& y = prediction.outputs[0];
  double log_score = 0;
  for (Eigen::Index k = 0; k < 8; ++k) {
    const double t = kTimes[static_cast<size_t>(k)], z = kValues[static_cast<size_t>(k)];
    const double sd = exact.StdDev(t), spread = exact.SampleStdDev(t);
    EXPECT_EQ(prediction.rows[static_cast<size_t>(k)].time_s, t);
    // 4,000 draws know a mean to 1/63 and a limit to 0.04 standard deviations.
    EXPECT_NEAR(y.mean[k], exact.Mean(t), 0.05 * sd);
    EXPECT_NEAR(y.std_dev[k], sd, 0.04 * sd);
    EXPECT_NEAR(y.quantiles(k, 0), exact.Mean(t) - 1.96 * sd, 0.12 * sd);
    EXPECT_NEAR(y.quantiles(k, 2), exact.Mean(t) + 1.96 * sd, 0.12 * sd);
    EXPECT_NEAR(y.sample_std_dev[k], spread, 0.01 * spread);
    EXPECT_NEAR(y.sample_quantiles(k, 0), exact.Mean(t) - 1.96 * spread, 0.03 * spread);
    EXPECT_EQ(y.measured[k], z);
    EXPECT_EQ(y.residual[k], z - y.mean[k]);
    EXPECT_NEAR(y.standardized_residual[k], (z - exact.Mean(t)) / spread, 0.05);
    const double u = (z - exact.Mean(t)) / spread;
    log_score -= (0.5 * u * u + std::log(spread * std::sqrt(2 * std::numbers::pi))) / 8;
  }
  EXPECT_EQ(y.score.samples, 8);
  EXPECT_NEAR(y.score.log_score, log_score, 0.02);
}

TEST(Prediction, OfAnotherRecordScoresSamplesThatTheEstimateHasNotSeen) {
  const auto estimator = Processed(LineProblem(), kValues);
  const Line exact(kTimes, kValues);
  PredictionOptions options;
  options.draws = kDraws;
  options.record.emplace();
  options.record->time_s = {0.5, 10, 20};
  const double far = exact.Mean(20) + 3 * exact.SampleStdDev(20);
  options.record->columns = {{"y", {exact.Mean(0.5), 0, far}, {false, true, false}}};
  const Prediction prediction = PredictionOf(*estimator, options);
  const PredictedOutput& y = prediction.outputs[0];
  ASSERT_EQ(y.mean.size(), 3);
  EXPECT_NEAR(y.std_dev[2], exact.StdDev(20), 0.04 * exact.StdDev(20));
  EXPECT_TRUE(std::isnan(y.measured[1]) && std::isnan(y.residual[1]));
  EXPECT_EQ(y.score.samples, 2);
  EXPECT_EQ(y.score.coverage95, 0.5);
  const auto log_normal = [&](double u, double t) {
    return -0.5 * u * u - std::log(exact.SampleStdDev(t) * std::sqrt(2 * std::numbers::pi));
  };
  EXPECT_NEAR(y.score.log_score, (log_normal(0, 0.5) + log_normal(3, 20)) / 2, 0.1);
  EXPECT_EQ(estimator->rows_appended(), 8);  // the estimator keeps its own record
}

TEST(Prediction, IsMadeAtTimesAskedFor) {
  const auto estimator = Processed(LineProblem(), kValues);
  const Line exact(kTimes, kValues);
  PredictionOptions options;
  options.draws = kDraws;
  options.times = {{0, 0}, {0, 2}, {0, 2.5}, {0, 30}};
  options.probabilities = {0.5};
  const Prediction prediction = PredictionOf(*estimator, options);
  ASSERT_EQ(prediction.rows.size(), 4u);
  for (size_t k = 0; k < 4; ++k) {
    const double t = options.times[k].time_s;
    EXPECT_EQ(prediction.rows[k].time_s, t);
    EXPECT_NEAR(prediction.outputs[0].mean[static_cast<Eigen::Index>(k)], exact.Mean(t),
                0.05 * exact.StdDev(t));
  }
  EXPECT_EQ(prediction.outputs[0].quantiles.cols(), 1);
  EXPECT_EQ(prediction.outputs[0].score.samples, 8);  // of the record all the same
}

TEST(Prediction, ForecastsBeyondTheLastRow) {
  const auto estimator = Processed(LineProblem(), kValues);
  PredictionOptions options;
  options.draws = 50;
  options.max_rows = 4;
  options.forecast_s = 2;
  const Prediction forecast = PredictionOf(*estimator, options);
  options.forecast_s = 0;
  options.times = {{0, 8.5}, {0, 9}, {0, 9.5}, {0, 10}};
  const Prediction asked = PredictionOf(*estimator, options);
  ASSERT_EQ(forecast.rows.size(), 4u);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(forecast.rows[i].time_s, options.times[i].time_s);
  EXPECT_EQ(forecast.outputs[0].mean, asked.outputs[0].mean);
  EXPECT_EQ(forecast.outputs[0].quantiles, asked.outputs[0].quantiles);
  EXPECT_EQ(forecast.outputs[0].score.samples, 8);
}

TEST(Prediction, ThinsItsRowsAndScoresAllOfThem) {
  std::vector<double> values;
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal(0, kNoise);
  double wander = 0;
  for (int k = 1; k <= 1000; ++k) {
    wander = 0.6 * wander + 0.8 * normal(generator);
    values.push_back(1 + 0.003 * k + wander);
  }
  const auto estimator = Processed(LineProblem(), values);
  PredictionOptions all, few;
  all.lags = few.lags = 3;
  few.max_rows = 7;
  const Prediction whole = PredictionOf(*estimator, all), thinned = PredictionOf(*estimator, few);
  ASSERT_EQ(whole.rows.size(), 1000u);
  ASSERT_EQ(thinned.rows.size(), 7u);
  for (size_t i = 1; i < 7; ++i) {
    EXPECT_NEAR(thinned.rows[i].time_s - thinned.rows[i - 1].time_s, 1000.0 / 7, 1);
  }
  const PredictionScore& score = thinned.outputs[0].score;
  EXPECT_EQ(score.samples, 1000);
  EXPECT_EQ(score.log_score, whole.outputs[0].score.log_score);
  const Vector& u = whole.outputs[0].standardized_residual;
  for (Eigen::Index lag = 1; lag <= 3; ++lag) {
    const double product = u.head(1000 - lag).dot(u.tail(1000 - lag));
    EXPECT_NEAR(score.autocorrelation[lag - 1], product / u.squaredNorm(), 1e-9);
  }
  EXPECT_NEAR(score.autocorrelation[0], 0.6, 0.08);
  PredictionOptions last = few;
  last.first_scored_row = 400;
  const PredictionScore of_last = PredictionOf(*estimator, last).outputs[0].score;
  EXPECT_EQ(of_last.samples, 600);
  const Vector residuals = whole.outputs[0].residual.tail(600);
  EXPECT_NEAR(of_last.root_mean_square, std::sqrt(residuals.squaredNorm() / 600), 1e-12);
}

TEST(Prediction, TakesRunsOwnParametersOfAnotherRecordFromThePrior) {
  UncertainParameter offset = UncertainParameter::Normal("a", 0, 2).value();
  offset.per_run = true;
  const Problem problem =
      TextProblem("a + b*t", {offset, UncertainParameter::Normal("b", 0, 1).value()}, 0.01);
  const auto estimator = Processed(problem, {3.5, 4, 4.5, 5});
  PredictionOptions options;
  options.draws = kDraws;
  EXPECT_LT(PredictionOf(*estimator, options).outputs[0].std_dev[0], 0.02);
  options.record.emplace();
  options.record->time_s = {0, 1, 0, 1};
  options.record->run = {0, 0, 1, 1};
  options.record->columns = {{"y", {0, 0, 0, 0}, {}}};
  const Prediction prediction = PredictionOf(*estimator, options);
  for (Eigen::Index k = 0; k < 4; ++k) {
    EXPECT_NEAR(prediction.outputs[0].std_dev[k], 2, 0.05);
  }
  EXPECT_NEAR(prediction.outputs[0].mean[1] - prediction.outputs[0].mean[0], 0.5, 0.05);
}

TEST(Prediction, HasNoBandOfSamplesUntilTheNoiseIsKnown) {
  Problem problem = LineProblem();
  problem.measured[0].noise = {.unknown = true};
  const Prediction few = PredictionOf(*Processed(problem, {1, 2}), {});
  EXPECT_EQ(few.outputs[0].sample_std_dev.size(), 0);
  EXPECT_EQ(few.outputs[0].residual.size(), 2);
  std::vector<double> values;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal(0, kNoise);
  for (int k = 1; k <= 200; ++k) values.push_back(1 + 0.01 * k + normal(generator));
  const Prediction many = PredictionOf(*Processed(problem, values), {});
  EXPECT_NEAR(many.outputs[0].sample_std_dev[100], kNoise, 0.15 * kNoise);
  EXPECT_NEAR(many.outputs[0].score.coverage95, 0.95, 0.03);
}

TEST(Prediction, DoesNotDependOnThreadsOrOnHowOftenItIsAsked) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.uncertain = {UncertainParameter::Normal("v0", 1, 0.1).value()};
  problem.measured = {{"x", {.absolute = 0.01}}};
  const Samples record = InitialVelocityRecord({0.1, 0.2, 0.4, 0.7, 1.1}, 1.05, 0.01);
  std::vector<Vector> means;
  for (const int threads : {1, 2}) {
    const auto estimator =
        MakeEstimator(problem, {.threads = threads, .store = {}, .snapshot = {}});
    ASSERT_TRUE(estimator->Append(record).ok());
    ASSERT_TRUE(estimator->Process().ok());
    means.push_back(PredictionOf(*estimator, {}).outputs[0].mean);
    means.push_back(PredictionOf(*estimator, {}).outputs[0].mean);
  }
  for (const Vector& mean : means) EXPECT_EQ(mean, means[0]);
}

TEST(Prediction, RefusesWhatItCannotPredict) {
  const auto estimator = Processed(LineProblem(), kValues);
  const auto refusal = [&](auto change) {
    PredictionOptions options;
    change(options);
    return std::string(estimator->CurrentPrediction(options).status().message());
  };
  const auto contains = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_PRED2(contains, refusal([](auto& o) { o.outputs = {"q"}; }), "no output \"q\"");
  EXPECT_PRED2(contains, refusal([](auto& o) { o.probabilities = {1}; }), "probabilities[0]: 1");
  EXPECT_PRED2(contains, refusal([](auto& o) { o.draws = 1; }), "draws: 1 must be from 2");
  EXPECT_PRED2(contains, refusal([](auto& o) { o.max_rows = 0; }), "max_rows: 0 must be from 1");
  EXPECT_PRED2(contains, refusal([](auto& o) { o.lags = -1; }), "lags: -1 must be from 0");
  EXPECT_PRED2(contains, refusal([](auto& o) { o.first_scored_row = -1; }),
               "first_scored_row: -1 must be from 0");
  EXPECT_PRED2(contains, refusal([](auto& o) {
                 o.times = {{1, 0.5}};
               }),
               "times[0].run: the record has no run 1");
  EXPECT_PRED2(contains, refusal([](auto& o) {
                 o.times = {{-1, 0.5}};
               }),
               "times[0].run: -1 must be at least 0");
  EXPECT_PRED2(contains, refusal([](auto& o) { o.probabilities.assign(1'001, 0.5); }),
               "probabilities: 1001 are given; the limit is 1000");
  // A forecast has as many times as it may have rows, however short the record.
  EXPECT_PRED2(contains, refusal([](auto& o) {
                 o.forecast_s = 1;
                 o.max_rows = 1'000'000;
               }),
               "would have 12000000 numbers");
  EXPECT_PRED2(contains, refusal([](auto& o) { o.times = {{0, 2}, {0, 1}}; }), "times[1]: run 0");
  EXPECT_PRED2(contains, refusal([](auto& o) { o.times = {{0, -1}}; }), "times[0].time_s: -1");
  EXPECT_PRED2(contains, refusal([](auto& o) { o.forecast_s = -1; }), "forecast_s: -1 must be");
  EXPECT_PRED2(contains, refusal([](auto& o) { o.forecast_s = 1e-300; }),
               "forecast_s: 1e-300 is too small");
  EXPECT_PRED2(contains, refusal([](auto& o) {
                 o.forecast_s = 1;
                 o.times = {{0, 1}};
               }),
               "forecast_s: cannot be combined with times");
  EXPECT_PRED2(contains, refusal([](auto& o) {
                 o.record.emplace();
                 o.record->time_s = {1};
                 o.record->columns = {{"z", {1}, {}}};
               }),
               "column \"z\" is neither");
}

TEST(Prediction, RefusesTimesWhereTheStreamedInputsAreNotKnown) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.uncertain = {UncertainParameter::Normal("k", 40, 4).value()};
  problem.inputs = {{"force", StreamedInput{}}};
  problem.measured = {{"x", {.absolute = 0.01}}};
  Samples record;
  for (int k = 0; k < 20; ++k) record.time_s.push_back(0.05 * k);
  record.columns = {{"x", std::vector<double>(20, 0), {}},
                    {"force", std::vector<double>(20, 1), {}}};
  record.end_of_run = true;
  const auto estimator = MakeEstimator(problem);
  ASSERT_TRUE(estimator->Append(record).ok());
  ASSERT_TRUE(estimator->Process().ok());
  PredictionOptions options;
  options.times = {{0, 0.51}, {0, 0.96}};
  EXPECT_EQ(estimator->CurrentPrediction(options).status().message(),
            "times[1].time_s: t = 0.96 s is after the last row of run 0; the streamed inputs are "
            "not known there");
  options.times.clear();
  options.forecast_s = 1;
  EXPECT_EQ(estimator->CurrentPrediction(options).status().message(),
            "forecast_s: 1 needs inputs that are known in advance, and one is streamed");
  options.forecast_s = 0;
  options.times = {{0, 0.51}};
  options.outputs = {"v", "x"};
  const Prediction prediction = PredictionOf(*estimator, options);
  ASSERT_EQ(prediction.outputs.size(), 2u);
  EXPECT_EQ(prediction.outputs[0].unit, "m/s");
  EXPECT_EQ(prediction.outputs[0].sample_std_dev.size(), 0);  // not measured
  EXPECT_EQ(prediction.outputs[1].sample_std_dev.size(), 1);
}

}  // namespace
}  // namespace polyest::internal::prediction_test
