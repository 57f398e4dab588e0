// Predictions of parameters that drift. The oracle is the exact filter of the local level model.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/estimator/local_level.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

// Expects the predictions from row 60 on, where the level at the beginning no longer matters, to be
// those of the exact filter after the rows that `used` returns for a row.
void ExpectExact(const Samples& samples, const Prediction& prediction,
                 const std::function<size_t(size_t)>& used) {
  ASSERT_EQ(prediction.outputs.size(), 2u);  // y and what drifts, a
  const PredictedOutput& y = prediction.outputs[0];
  for (size_t row = 60; row < prediction.rows.size(); ++row) {
    const size_t rows = used(row);
    const LocalLevel level = ExactFilter(samples, kRate, rows);
    const double since = prediction.rows[row].time_s - static_cast<double>(rows) * kLevelStepS;
    const double deviation = std::sqrt(level.variance + kRate * kRate * since);
    const auto k = static_cast<Eigen::Index>(row);
    EXPECT_NEAR(y.mean[k], level.mean, 1e-6 * deviation) << row;
    EXPECT_NEAR(y.std_dev[k], deviation, 1e-6 * deviation) << row;
    EXPECT_NEAR(y.quantiles(k, 2), level.mean + 1.959964 * deviation, 1e-5 * deviation) << row;
    if (row < samples.rows()) {
      EXPECT_NEAR(y.sample_std_dev[k], std::hypot(deviation, kLevelSigma), 1e-6 * deviation) << row;
    }
  }
}

TEST(DriftPrediction, PredictsEachRowFromTheRowsBefore) {
  const Samples samples = Walk(150, 4);
  const auto estimator = MakeEstimator(DriftingLevel());
  ASSERT_TRUE(estimator->Append(samples).ok());
  ASSERT_TRUE(estimator->Process().ok());
  PredictionOptions options;
  options.draws = 50;
  const auto each = estimator->CurrentPrediction(options);
  ASSERT_TRUE(each.ok()) << each.status();
  ExpectExact(samples, *each, [](size_t row) { return row; });
  EXPECT_EQ(each->outputs[0].score.samples, 150);
  // 95 % of 150: 142.5 ± 3 · 2.7.
  EXPECT_NEAR(each->outputs[0].score.coverage95, 0.95, 3 * 2.7 / 150);

  // Windows of ten rows: row 60 is the first of the seventh.
  options.horizon_s = 10.5 * kLevelStepS;
  const auto windows = estimator->CurrentPrediction(options);
  ASSERT_TRUE(windows.ok()) << windows.status();
  ExpectExact(samples, *windows, [](size_t row) { return row / 10 * 10; });

  // Forecasts after the last row, from all.
  options.horizon_s = 0;
  for (int i = 1; i <= 100; ++i) options.times.push_back({0, (150 + i) * kLevelStepS});
  const auto forecasts = estimator->CurrentPrediction(options);
  ASSERT_TRUE(forecasts.ok()) << forecasts.status();
  ExpectExact(samples, *forecasts, [](size_t) { return size_t{150}; });
}

// The output is the level itself, so that both are predicted alike; a gain is the channel's alone.
TEST(DriftPrediction, IsPredictedOverTime) {
  Problem problem = DriftingLevel();
  problem.fixed = {{"y.gain", 2}};
  Samples samples = Walk(60, 4);
  for (double& value : samples.columns[0].value) value *= 2;
  problem.measured[0].noise.absolute = 2 * kLevelSigma;
  const auto estimator = MakeEstimator(problem);
  ASSERT_TRUE(estimator->Append(samples).ok());
  ASSERT_TRUE(estimator->Process().ok());
  PredictionOptions options;
  options.outputs = {"y", "a"};
  options.draws = 50;
  const auto prediction = estimator->CurrentPrediction(options);
  ASSERT_TRUE(prediction.ok()) << prediction.status();
  const PredictedOutput &y = prediction->outputs[0], &a = prediction->outputs[1];
  EXPECT_EQ(a.output, "a");
  EXPECT_EQ(a.unit, "N");
  EXPECT_EQ(a.measured.size(), 0);
  EXPECT_TRUE(a.mean.isApprox(0.5 * y.mean, 1e-12));
  EXPECT_TRUE(a.quantiles.isApprox(0.5 * y.quantiles, 1e-9));
  options.outputs = {"b"};
  EXPECT_THAT(std::string(estimator->CurrentPrediction(options).status().message()),
              HasSubstr("it has y, a"));
}

// The level given all samples is the exact filter's, run forward and backward in time: N(f, F) from
// the rows up to one and N(b, B) from those after it agree on the mean (f/F + b/B)/(1/F + 1/B).
// From row 60 on the level at the beginning no longer matters.
TEST(DriftPrediction, IsSmoothedByLaterSamples) {
  constexpr size_t kRows = 150;
  const Samples samples = Walk(kRows, 4);
  const auto estimator = MakeEstimator(DriftingLevel());
  ASSERT_TRUE(estimator->Append(samples).ok());
  ASSERT_TRUE(estimator->Process().ok());
  PredictionOptions options;
  options.draws = 50;
  options.smoothed = true;
  const auto smoothed = estimator->CurrentPrediction(options);
  ASSERT_TRUE(smoothed.ok()) << smoothed.status();
  const PredictedOutput &y = smoothed->outputs[0], &a = smoothed->outputs[1];
  EXPECT_EQ(y.measured.size(), static_cast<Eigen::Index>(kRows));
  EXPECT_EQ(y.sample_std_dev.size(), 0);
  EXPECT_EQ(y.score.samples, 0);
  LocalLevel backward{0, 1e12, 0};  // after the last row
  for (size_t row = kRows; row-- > 60;) {
    const LocalLevel forward = ExactFilter(samples, kRate, row + 1);
    const double information = 1 / forward.variance + 1 / backward.variance;
    const double mean =
        (forward.mean / forward.variance + backward.mean / backward.variance) / information;
    const double deviation = std::sqrt(1 / information);
    const auto k = static_cast<Eigen::Index>(row);
    EXPECT_NEAR(a.mean[k], mean, 1e-6 * deviation) << row;
    EXPECT_NEAR(a.std_dev[k], deviation, 1e-6 * deviation) << row;
    EXPECT_NEAR(y.mean[k], mean, 1e-6 * deviation) << row;
    const double S = backward.variance + kLevelSigma * kLevelSigma;
    backward.mean += backward.variance / S * (samples.columns[0].value[row] - backward.mean);
    backward.variance *= kLevelSigma * kLevelSigma / S;
    backward.variance += kRate * kRate * kLevelStepS;
  }
  // Of more rows than are asked for, and at other times.
  options.max_rows = 10;
  const auto thinned = estimator->CurrentPrediction(options);
  ASSERT_TRUE(thinned.ok()) << thinned.status();
  EXPECT_NEAR(thinned->outputs[1].mean[5], a.mean[75], 1e-9);
  options.times = {{0, 75.5 * kLevelStepS}, {0, (kRows + 10) * kLevelStepS}};
  const auto between = estimator->CurrentPrediction(options);
  ASSERT_TRUE(between.ok()) << between.status();
  EXPECT_NEAR(between->outputs[1].mean[0], (a.mean[74] + a.mean[75]) / 2, 1e-9);
}

// With N(f, F) before a row and N(b, B) from that row and those after it, a step there has the
// score (b − f)/√(F + B).
TEST(DriftPrediction, TellsAnAbruptChangeFromAWalk) {
  constexpr size_t kRows = 150, kChanged = 100;
  const auto change_of = [](const Samples& samples) {
    const auto estimator = MakeEstimator(DriftingLevel());
    EXPECT_TRUE(estimator->Append(samples).ok());
    EXPECT_TRUE(estimator->Process().ok());
    PredictionOptions options;
    options.draws = 50;
    options.smoothed = true;
    const auto smoothed = estimator->CurrentPrediction(options);
    EXPECT_TRUE(smoothed.ok()) << smoothed.status();
    EXPECT_FALSE(smoothed->outputs[0].abrupt_change.has_value());  // y is no parameter
    return smoothed->outputs[1].abrupt_change;
  };
  Samples samples = Walk(kRows, 4);
  EXPECT_FALSE(change_of(samples).has_value());

  for (size_t row = kChanged; row < kRows; ++row) samples.columns[0].value[row] -= 12 * kLevelSigma;
  double largest = 0;
  LocalLevel backward{0, 1e12, 0};
  for (size_t row = kRows; row-- > 60;) {
    const LocalLevel before = ExactFilter(samples, kRate, row);
    const double predicted = before.variance + kRate * kRate * kLevelStepS;
    const double S = backward.variance + kLevelSigma * kLevelSigma;
    backward.mean += backward.variance / S * (samples.columns[0].value[row] - backward.mean);
    backward.variance *= kLevelSigma * kLevelSigma / S;
    const double score = (backward.mean - before.mean) / std::sqrt(predicted + backward.variance);
    if (std::abs(score) > std::abs(largest)) largest = score;
    backward.variance += kRate * kRate * kLevelStepS;
  }
  const auto change = change_of(samples);
  ASSERT_TRUE(change.has_value());
  EXPECT_EQ(change->at.run, 0);
  EXPECT_NEAR(change->at.time_s, samples.time_s[kChanged], 1e-12);
  EXPECT_NEAR(change->score, largest, 1e-5 * std::abs(largest));
  EXPECT_NEAR(change->limit, 3.99, 0.01);  // of N(0, 1), 0.005/150 above it
}

TEST(DriftPrediction, RefusesSmoothingThatIsNone) {
  PredictionOptions options;
  options.smoothed = true;
  options.horizon_s = 1;
  const auto message = [&](const Problem& problem) {
    const auto estimator = MakeEstimator(problem);
    EXPECT_TRUE(estimator->Append(Walk(20, 4)).ok());
    EXPECT_TRUE(estimator->Process().ok());
    return std::string(estimator->CurrentPrediction(options).status().message());
  };
  EXPECT_EQ(message(DriftingLevel()), "smoothed: true leaves no sample out, unlike horizon_s");
  options.horizon_s = 0;
  Problem perfect = DriftingLevel();
  perfect.uncertain[0].drift.reset();
  EXPECT_THAT(message(perfect), HasSubstr("smoothed: true needs likelihood PREDICTION_ERROR"));
}

TEST(DriftPrediction, RefusesHorizonsThatAreNone) {
  const auto estimator = MakeEstimator(DriftingLevel());
  ASSERT_TRUE(estimator->Append(Walk(20, 4)).ok());
  ASSERT_TRUE(estimator->Process().ok());
  PredictionOptions options;
  options.horizon_s = -1;
  EXPECT_EQ(estimator->CurrentPrediction(options).status().message(),
            "horizon_s: -1 must be a finite time ≥ 0");
  Problem perfect = DriftingLevel();
  perfect.uncertain[0].drift.reset();
  const auto other = MakeEstimator(perfect);
  ASSERT_TRUE(other->Append(Walk(20, 4)).ok());
  ASSERT_TRUE(other->Process().ok());
  options.horizon_s = 1;
  EXPECT_THAT(std::string(other->CurrentPrediction(options).status().message()),
              HasSubstr("horizon_s: 1 needs likelihood PREDICTION_ERROR"));
}

}  // namespace
}  // namespace polyest::internal
