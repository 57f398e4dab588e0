// The limit on the rows that an update propagates again. The oracle of the bound is the number of
// rows that are read from the store, and that of the estimate the true parameter.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/estimator/expansion/replay_allowance.h"
#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/memory_store.h"
#include "tests/unit/core/estimator/snapshot_session.h"

namespace polyest::internal::replay_limit_test {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kLimit = 4 * kInterval;
constexpr size_t kBatch = 50;
constexpr double kStepTime = 60.8;  // s: nothing moves before, and a state has just been kept
constexpr double kTrueStiffness = 9.7;

// Counts the rows that are read.
class CountingStore final : public SampleStore {
 public:
  int64_t rows() const override { return store_.rows(); }
  absl::Status Append(const RowBlock& block) override { return store_.Append(block); }
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override {
    read_ += count;
    return store_.Read(first, count, block);
  }
  int64_t TakeCount() { return std::exchange(read_, 0); }

 private:
  MemoryStore store_;
  mutable int64_t read_ = 0;
};

// The record says nothing of k until the step, so that the expansion must move late.
Problem LateStep(std::optional<int64_t> limit) {
  Problem problem = OscillatorProblem();
  problem.fixed = {{"m", 1}, {"c", 0.1}, {"x0", 0}, {"v0", 0}};
  problem.uncertain = {UncertainParameter::Uniform("k", 8, 12).value()};
  problem.inputs = {{"force", StepInput{.amplitude = 5, .time_s = kStepTime}}};
  problem.integration.samples_between_checkpoints = kInterval;
  problem.expansion.max_replay_row_count = limit;
  return problem;
}

Samples LateRecord(int rows = 2400, double noise = 0.02) {
  const auto response = [](double t) {
    const double s = t - kStepTime, frequency = std::sqrt(kTrueStiffness - 0.0025);
    if (s <= 0) return 0.0;
    const double swing = std::cos(frequency * s) + 0.05 / frequency * std::sin(frequency * s);
    return 5 / kTrueStiffness * (1 - std::exp(-0.05 * s) * swing);
  };
  return Record("x", response, noise, rows);
}

Samples Part(const Samples& all, size_t first, size_t count) {
  Samples part;
  part.columns = {{all.columns[0].name, {}, {}}};
  for (size_t i = first; i < std::min(first + count, all.rows()); ++i) {
    part.time_s.push_back(all.time_s[i]);
    part.run.push_back(all.run[i]);
    part.columns[0].value.push_back(all.columns[0].value[i]);
  }
  return part;
}

// Returns the most rows that an update of kBatch rows reads.
int64_t MostRead(const Problem& problem) {
  const Samples all = LateRecord();
  const auto store = std::make_shared<CountingStore>();
  const auto estimator = MakeEstimator(problem, {.store = store, .snapshot = {}});
  int64_t most = 0;
  for (size_t first = 0; first < all.rows(); first += kBatch) {
    EXPECT_TRUE(estimator->Append(Part(all, first, kBatch)).ok());
    store->TakeCount();
    EXPECT_TRUE(estimator->Process().ok());
    most = std::max(most, store->TakeCount());
  }
  return most;
}

// A block that ends where a state is kept is read twice, and the rest of one that was left because
// the expansion moved again.
TEST(ReplayLimit, BoundsTheRowsOfAnUpdate) {
  EXPECT_LE(MostRead(LateStep(kLimit)), 2 * (kLimit + 2 * kBatch));
  EXPECT_GT(MostRead(LateStep(std::nullopt)), 1200);
}

TEST(ReplayLimit, BoundsTheRowsOfFilters) {
  Problem problem = LateStep(std::nullopt);
  problem.process_noise = {{.state = "v", .spectral_density = 1e-5}};
  EXPECT_GT(MostRead(problem), 1200);
  problem.expansion.max_replay_row_count = kLimit;
  EXPECT_LE(MostRead(problem), 2 * (kLimit + 2 * kBatch));
}

// A state is kept 16 rows before the step. The expansion over this prior does not follow the model
// for the 150 rows that it takes to judge whether its sums can be carried over.
constexpr int kLongInterval = 300;
constexpr int64_t kLongLimit = 4 * kLongInterval;

Problem WideLateStep(std::optional<int64_t> limit) {
  Problem problem = LateStep(limit);
  problem.integration.samples_between_checkpoints = kLongInterval;
  problem.uncertain = {UncertainParameter::Uniform("k", 2, 40).value()};
  problem.measured[0].noise.absolute = 0.002;
  return problem;
}

TEST(ReplayLimit, SaysWhatItHasPutOffAndIdentifiesNothing) {
  const Samples record = LateRecord(1400, 0.002);
  const Estimate free = EstimateOf(WideLateStep(std::nullopt), record);
  EXPECT_EQ(free.parameters[0].verdict, Verdict::kIdentified);
  EXPECT_FALSE(Has(free, DiagnosticCode::kReplayPostponed));
  const Estimate limited = EstimateOf(WideLateStep(kLongLimit), record);
  EXPECT_THAT(Message(limited, DiagnosticCode::kReplayPostponed),
              HasSubstr("expansion.maxReplayRowCount = 1200 keeps the record from"));
  EXPECT_NE(limited.parameters[0].verdict, Verdict::kIdentified);
  EXPECT_GE(limited.parameters[0].posterior_std_dev, free.parameters[0].posterior_std_dev);
  EXPECT_LE(limited.parameters[0].lower95, kTrueStiffness);
  EXPECT_GE(limited.parameters[0].upper95, kTrueStiffness);
}

TEST(ReplayLimit, ChangesNothingUntilItIsReached) {
  const Samples record = LateRecord(1600);
  ExpectSame(EstimateOf(LateStep(1'000'000), record), EstimateOf(LateStep(std::nullopt), record));
}

void ExpectSameForAnyBatches(const Problem& problem, const Samples& record, size_t part) {
  const Estimate expected = EstimateOf(problem, record);
  Session session(problem, 2);
  for (size_t first = 0; first < part; first += 13) session.Take(Part(record, first, 13));
  ASSERT_FALSE(session.rows.empty());
  const auto taken = static_cast<size_t>(session.estimator->rows_processed());
  Session restored(problem);
  ASSERT_TRUE(restored.estimator->Append(Part(record, 0, taken)).ok());
  ASSERT_TRUE(restored.estimator->Restore(session.last).ok());
  for (Session* one : {&session, &restored}) {
    one->Take(Part(record, taken, record.rows()));
    ExpectSame(one->Current(), expected);
  }
}

TEST(ReplayLimit, DoesNotDependOnBatchesThreadsOrSnapshots) {
  ExpectSameForAnyBatches(LateStep(kLimit), LateRecord(1500), 1300);
}

// The snapshot is of row 1500, when a move has been put off.
TEST(ReplayLimit, IsRestoredWithWhatHasBeenPutOff) {
  ExpectSameForAnyBatches(WideLateStep(kLongLimit), LateRecord(1560, 0.002), 1530);
}

TEST(ReplayLimit, ComesBackRowByRow) {
  ReplayAllowance allowance(100);
  EXPECT_TRUE(allowance.AllowsRecord(100));
  EXPECT_FALSE(allowance.AllowsRecord(101));
  allowance.Use(60, 60);
  EXPECT_TRUE(allowance.Allows(60, 40));
  EXPECT_FALSE(allowance.Allows(60, 41));
  EXPECT_TRUE(allowance.Allows(70, 50));
  EXPECT_FALSE(allowance.Allows(70, 51));
  EXPECT_TRUE(allowance.Allows(500, 100));
  EXPECT_FALSE(allowance.Allows(500, 101));
  allowance.ExemptAt(500);
  EXPECT_TRUE(allowance.AllowsRecord(500));
  EXPECT_FALSE(allowance.AllowsRecord(501));
  EXPECT_TRUE(ReplayAllowance().AllowsRecord(int64_t{1} << 40));
}

TEST(ReplayLimit, MustLetAShortRecordBePropagatedAgain) {
  const auto refusal = [](const Problem& problem) {
    return std::string(ResolvedProblem::Make(problem).status().message());
  };
  Problem problem = LateStep(kLimit - 1);
  EXPECT_THAT(refusal(problem),
              HasSubstr("expansion.max_replay_row_count: 127 must be at least 128"));
  problem = LateStep(kLimit);
  problem.uncertain[0].per_run = true;
  EXPECT_THAT(refusal(problem), HasSubstr("is not available with a parameter of each run, k"));
}

}  // namespace
}  // namespace polyest::internal::replay_limit_test
