// Tests the estimator as a stream: what must not change its answers, and what it refuses.

#include "polyest/estimator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <stop_token>

#include "core/estimator/problem/resolved_problem.h"
#include "core/model/interpolation.h"
#include "tests/testing/oscillator.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/estimator/stopping_store.h"

namespace polyest::internal {
namespace {

using testing::EstimateInBatches;
using testing::Rows;

Samples TenSeconds() {
  testing::OscillatorTruth truth;
  return testing::OscillatorRecord(10, 3, truth);
}

// Returns the estimate of TenSeconds with order 3, computed in one piece.
const Estimate& Undisturbed() {
  static const Estimate estimate =
      EstimateInBatches(testing::OscillatorProblem(3), TenSeconds(), 1000);
  return estimate;
}

TEST(Estimator, NeedsAMeasuredOutput) {
  Problem problem = testing::OscillatorProblem(3);
  problem.measured.clear();
  const auto estimator = Estimator::Make(problem);
  EXPECT_EQ(estimator.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(estimator.status().message(), "measured: at least one output must be measured");
}

TEST(Estimator, IsTheSameBitsForAnyBatches) {
  EXPECT_GT(Undisturbed().expansion.reexpansions, 0);
  for (const size_t rows : {1, 7}) {
    ExpectSame(EstimateInBatches(testing::OscillatorProblem(3), TenSeconds(), rows), Undisturbed());
  }
}

// The 80 points make two blocks of the ensemble, so that threads have work to share.
TEST(Estimator, IsTheSameBitsForAnyThreads) {
  Problem problem = testing::OscillatorProblem(3);
  problem.expansion.points_per_term = 8;
  ExpectSame(EstimateInBatches(problem, TenSeconds(), 50, /*threads=*/1),
             EstimateInBatches(problem, TenSeconds(), 50, /*threads=*/2));
}

TEST(Estimator, IsNotChangedByBeingAsked) {
  const Samples record = TenSeconds();
  const auto estimator = MakeEstimator(testing::OscillatorProblem(3));
  for (size_t first = 0; first < record.rows(); first += 40) {
    ASSERT_TRUE(estimator->Append(Rows(record, first, 40)).ok());
    EXPECT_TRUE(estimator->CurrentEstimate().ok());
    ASSERT_TRUE(estimator->Process().ok());
    ExpectSame(estimator->CurrentEstimate().value(), estimator->CurrentEstimate().value());
  }
  ExpectSame(estimator->CurrentEstimate().value(), Undisturbed());
}

TEST(Estimator, CountsTheRowsAppendedAndProcessed) {
  const Samples record = TenSeconds();
  const auto estimator = MakeEstimator(testing::OscillatorProblem(3));
  ASSERT_TRUE(estimator->Append(Rows(record, 0, 5)).ok());
  EXPECT_EQ(estimator->rows_appended(), 5);
  EXPECT_EQ(estimator->rows_processed(), 0);
  ASSERT_TRUE(estimator->Process().ok());
  EXPECT_EQ(estimator->rows_processed(), 5);
  const Estimate estimate = estimator->CurrentEstimate().value();
  EXPECT_EQ(estimate.samples, 5);
  EXPECT_EQ(estimate.time_s, record.time_s[4]);
}

TEST(Estimator, TakesNothingWhenAlreadyStoppedAndGoesOnLater) {
  const auto estimator = MakeEstimator(testing::OscillatorProblem(3));
  ASSERT_TRUE(estimator->Append(TenSeconds()).ok());
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(estimator->Process(Stop(source.get_token())).code(), absl::StatusCode::kCancelled);
  const Stop past({}, Stop::Clock::now() - std::chrono::seconds(1));
  EXPECT_EQ(estimator->Process(past).code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(estimator->CurrentEstimate(past).status().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(estimator->rows_processed(), 0);
  ASSERT_TRUE(estimator->Process().ok());
  ExpectSame(estimator->CurrentEstimate().value(), Undisturbed());
}

TEST(Estimator, IsNotMadeWhenAlreadyStopped) {
  const Stop past({}, Stop::Clock::now() - std::chrono::seconds(1));
  EXPECT_EQ(Estimator::Make(testing::OscillatorProblem(3), {}, past).status().code(),
            absl::StatusCode::kDeadlineExceeded);
}

TEST(Estimator, ReachesTheSameBitsThroughAnyStops) {
  const auto store = std::make_shared<StoppingStore>();
  EstimatorOptions options;
  options.store = store;
  const auto estimator = MakeEstimator(testing::OscillatorProblem(3), options);
  ASSERT_TRUE(estimator->Append(TenSeconds()).ok());
  EXPECT_EQ(store->rows(), 200);
  int stops = 0;
  absl::Status status = absl::CancelledError("");
  // Each round reads once more, so that every step is reached and every second one is disturbed.
  for (int reads = 1; absl::IsCancelled(status) && reads < 100; ++reads) {
    status = estimator->Process(store->StopAfter(reads));
    if (absl::IsCancelled(status)) ++stops;
    EXPECT_TRUE(estimator->CurrentEstimate().ok());
  }
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_GT(stops, 2);
  ExpectSame(estimator->CurrentEstimate().value(), Undisturbed());
}

TEST(Estimator, IsNotChangedByABatchItRefused) {
  const Samples record = TenSeconds();
  const auto estimator = MakeEstimator(testing::OscillatorProblem(3));
  ASSERT_TRUE(estimator->Append(Rows(record, 0, 100)).ok());
  ASSERT_TRUE(estimator->Process().ok());
  Samples bad = Rows(record, 100, 100);
  bad.columns[0].value[99] = std::nan("");
  EXPECT_EQ(estimator->Append(bad).code(), absl::StatusCode::kInvalidArgument);
  bad = Rows(record, 100, 100);
  bad.time_s[50] = 0;
  EXPECT_EQ(estimator->Append(bad).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(estimator->rows_appended(), 100);
  ASSERT_TRUE(estimator->Append(Rows(record, 100, 100)).ok());
  ASSERT_TRUE(estimator->Process().ok());
  ExpectSame(estimator->CurrentEstimate().value(), Undisturbed());
}

// Makes a problem that measures x of the forced oscillator. The force is a triangle wave with its
// knots at the samples.
Problem ForcedProblem(InputSpecification force) {
  Problem problem = testing::OscillatorProblem(3);
  problem.inputs = {{"force", std::move(force)}};
  return problem;
}

double Triangle(int k) { return 10.0 * std::abs(k % 8 - 4) - 20; }

Samples StreamedForceRecord() {
  testing::OscillatorTruth truth;
  Samples record = testing::OscillatorRecord(5, 3, truth);
  record.columns.push_back({"force", {}, {}});
  for (int k = 0; k < static_cast<int>(record.rows()); ++k) {
    record.columns[1].value.push_back(Triangle(k));
  }
  // The record is that of the forced oscillator with the same unknowns, from a fine run of the
  // model itself.
  TableInput table{.time_s = record.time_s, .value = record.columns[1].value};
  Problem exact = ForcedProblem(table);
  exact.integration.relative_tolerance = 1e-12;
  const ResolvedProblem resolved = ResolvedProblem::Make(exact).value();
  const InputSignals inputs = resolved.MakeInputs();
  const Matrix theta = Eigen::RowVector2d(truth.k, truth.c);
  EnsemblePropagator model(resolved.MakeEnsemble(theta, resolved.outputs(), 1), &inputs);
  Matrix outputs(1, static_cast<Eigen::Index>(record.rows()));
  EXPECT_TRUE(model.Advance(record.time_s, outputs, {}).ok());
  for (size_t k = 0; k < record.rows(); ++k) {
    record.columns[0].value[k] +=
        outputs(0, static_cast<Eigen::Index>(k)) -
        testing::OscillatorDisplacement(truth.k, truth.c, record.time_s[k]);
  }
  return record;
}

TEST(Estimator, TakesAStreamedInputAsATableOfTheSameKnots) {
  const Samples streamed = StreamedForceRecord();
  Samples measured = streamed;
  measured.columns.pop_back();
  const TableInput table{.time_s = streamed.time_s, .value = streamed.columns[1].value};
  const Estimate a =
      EstimateInBatches(ForcedProblem(StreamedInput{Interpolation::kLinear}), streamed, 1000);
  const Estimate b = EstimateInBatches(ForcedProblem(table), measured, 1000);
  for (size_t i = 0; i < 2; ++i) {
    const ParameterEstimate& p = a.parameters[i];
    EXPECT_NEAR(p.map, b.parameters[i].map, 1e-3 * p.std_dev);
    EXPECT_NEAR(p.std_dev, b.parameters[i].std_dev, 1e-3 * p.std_dev);
  }
  EXPECT_NEAR(a.channels[0].chi_squared, 100, 4 * std::sqrt(200));
}

class StreamedCurve : public ::testing::TestWithParam<Interpolation> {};

INSTANTIATE_TEST_SUITE_P(AnyInterpolation, StreamedCurve,
                         ::testing::Values(Interpolation::kHold, Interpolation::kLinear,
                                           Interpolation::kCubic, Interpolation::kShapePreserving));

TEST_P(StreamedCurve, GivesTheSameBitsForAnyBatches) {
  Samples record = StreamedForceRecord();
  record.end_of_run = true;
  const Problem problem = ForcedProblem(StreamedInput{GetParam()});
  const Estimate whole = EstimateInBatches(problem, record, 1000);
  EXPECT_EQ(whole.samples, 100);
  ExpectSame(EstimateInBatches(problem, record, 1), whole);
  ExpectSame(EstimateInBatches(problem, record, 7), whole);
}

TEST_P(StreamedCurve, IsTheSameAsATableOfItsKnots) {
  Samples streamed = StreamedForceRecord();
  streamed.end_of_run = true;
  Samples measured = streamed;
  measured.columns.pop_back();
  const TableInput table{streamed.time_s, streamed.columns[1].value, GetParam()};
  const Estimate a = EstimateInBatches(ForcedProblem(StreamedInput{GetParam()}), streamed, 1000);
  const Estimate b = EstimateInBatches(ForcedProblem(table), measured, 1000);
  // The integrator steps over the samples of a table, but not over those of a stream. A step may
  // err by 1e-5 of the noise and there are a few hundred, so that the estimates agree to a percent
  // of a standard deviation.
  for (size_t i = 0; i < 2; ++i) {
    const ParameterEstimate& p = a.parameters[i];
    EXPECT_NEAR(p.map, b.parameters[i].map, 1e-2 * p.std_dev);
    EXPECT_NEAR(p.std_dev, b.parameters[i].std_dev, 1e-2 * p.std_dev);
  }
}

TEST(Estimator, LetsTheLastRowsOfASmoothInputWaitForWhatFollows) {
  Samples record = StreamedForceRecord();
  const auto estimator = MakeEstimator(ForcedProblem(StreamedInput{}));
  ASSERT_TRUE(estimator->Append(Rows(record, 0, 50)).ok());
  ASSERT_TRUE(estimator->Process().ok());
  EXPECT_EQ(estimator->rows_processed(), 50 - kSplineReach);
  Samples rest = Rows(record, 50, 50);
  ASSERT_TRUE(estimator->Append(rest).ok());
  Samples end;
  end.end_of_run = true;
  ASSERT_TRUE(estimator->Append(end).ok());
  ASSERT_TRUE(estimator->Process().ok());
  EXPECT_EQ(estimator->rows_processed(), 100);
}

TEST(Estimator, TakesRowsOfANewRunOnlyAfterTheEndOfARun) {
  Samples record = StreamedForceRecord();
  const auto estimator = MakeEstimator(ForcedProblem(StreamedInput{}));
  Samples first = Rows(record, 0, 10);
  first.end_of_run = true;
  ASSERT_TRUE(estimator->Append(first).ok());
  Samples more = Rows(record, 10, 10);
  EXPECT_EQ(estimator->Append(more).message(),
            "row 0 (counted from 0): run 0 has ended; further rows belong to a new run");
  more.run.assign(10, 1);
  EXPECT_TRUE(estimator->Append(more).ok());
  ASSERT_TRUE(estimator->Process().ok());
  EXPECT_EQ(estimator->rows_processed(), 20 - kSplineReach);
}

}  // namespace
}  // namespace polyest::internal
