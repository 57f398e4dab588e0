#include "server/sessions/journal_store.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "core/estimator/record/memory_store.h"
#include "polyest/catalogue.h"
#include "proto/wire/convert/measurements.h"
#include "server/digest/digest.h"
#include "server/journal/memory_journal.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

constexpr int64_t kSegment = JournalStore::kSegmentRows;

// Makes a problem with two channels whose noise depends on the largest sample so far, and whose
// samples are used depending on the last gear so far.
ResolvedProblem TwoChannels() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.uncertain = {UncertainParameter::Uniform("c", 0, 1).value()};
  problem.inputs = {{"force", StreamedInput{}}};
  problem.measured = {{"x", {.absolute = 0.1, .relative_to_max = 0.01}}, {"v", {.relative = 0.5}}};
  problem.use_when = "gear > 0";
  return ResolvedProblem::Make(problem).value();
}

bool AreSame(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void ExpectSameBits(const RowBlock& actual, const RowBlock& expected) {
  ASSERT_EQ(actual.rows.size(), expected.rows.size());
  for (size_t i = 0; i < expected.rows.size(); ++i) {
    ASSERT_EQ(actual.rows[i].run, expected.rows[i].run) << i;
    ASSERT_EQ(actual.rows[i].time_s, expected.rows[i].time_s) << i;
  }
  ASSERT_EQ(actual.values.size(), expected.values.size());
  for (size_t i = 0; i < expected.values.size(); ++i) {
    ASSERT_TRUE(AreSame(actual.values[i], expected.values[i])) << i;
  }
  EXPECT_EQ(actual.noise, expected.noise);
  EXPECT_EQ(actual.run_ended, expected.run_ended);
}

// Gives the same batches to a journal, to the store and to a store that keeps all in memory, which
// is the oracle.
class JournalStoreTest : public testing::Test {
 protected:
  void SetUp() override {
    SessionHead head;
    head.name = "sessions/a";
    number_ = journal_.Create(head, SmallProblem(), /*hidden=*/false).value();
    store_.ReadFrom(journal_, number_);
  }

  void Append(int rows, int run = 0, bool end_of_run = false) {
    v1::Measurements batch;
    v1::Measurements::Channel& x = *batch.add_channels();
    x.set_name("x");
    v1::Measurements::Channel& force = *batch.add_channels();
    force.set_name("force");
    v1::Measurements::Channel& gear = *batch.add_channels();
    gear.set_name("gear");
    for (int i = 0; i < rows; ++i, ++row_) {
      batch.add_time_s(0.01 * row_);
      batch.add_run(run);
      // The values grow, so that the noise of a row tells which rows went before.
      x.add_values((row_ + 1) * std::sin(row_));
      if (row_ % 7 == 3) x.add_missing(i);
      force.add_values(row_);
      gear.add_values(row_ / 500 % 3);
      if (row_ % 500 != 0) gear.add_missing(i);
    }
    batch.set_end_of_run(end_of_run);
    JournalEntry entry;
    entry.session = number_;
    entry.measurements = DeterministicBytes(batch);
    entry.digest = Digest(entry.measurements);
    entry.place.sequence = ++sequence_;
    journal_.Append(std::move(entry), [](const absl::Status& kept) { ASSERT_TRUE(kept.ok()); });
    const auto checked = checks_.Check(ToSamples(batch, *problem_.problem().model).value());
    ASSERT_TRUE(checked.ok()) << checked.status();
    checks_.Accept(*checked);
    ASSERT_TRUE(memory_.Append(*checked).ok());
    ASSERT_TRUE(store_.Append(*checked).ok());
  }
  void ExpectRead(int64_t first, int64_t count) {
    SCOPED_TRACE(testing::Message() << "rows [" << first << ", " << first + count << ")");
    RowBlock expected;
    ASSERT_TRUE(memory_.Read(first, count, expected).ok());
    RowBlock actual;
    const absl::Status read = store_.Read(first, count, actual);
    ASSERT_TRUE(read.ok()) << read;
    ExpectSameBits(actual, expected);
  }

  const ResolvedProblem problem_ = TwoChannels();
  MemoryJournal journal_;
  int64_t number_ = 0;
  SampleChecks checks_{problem_};
  MemoryStore memory_;
  JournalStore store_{problem_};
  int64_t sequence_ = 0;
  int row_ = 0;
};

TEST_F(JournalStoreTest, ReadsTheSameBitsFromTheJournalAsFromMemory) {
  for (int batch = 0; batch < 300; ++batch) Append(1 + batch % 89, batch / 150);
  const int64_t rows = store_.rows();
  ASSERT_EQ(rows, memory_.rows());
  ASSERT_GT(rows, 3 * kSegment);
  store_.Release(sequence_);
  for (int64_t first = 0; first + 64 <= rows; first += 64) ExpectRead(first, 64);
  ExpectRead(0, 1);
  ExpectRead(kSegment - 10, 2 * kSegment);
  ExpectRead(0, rows);
  ExpectRead(rows - 1, 1);
}

TEST_F(JournalStoreTest, HoldsFewRowsInMemoryHoweverManyThereAre) {
  for (int batch = 0; batch < 1'000; ++batch) {
    Append(100);
    store_.Release(sequence_);
  }
  // The store holds the segment that is added to and the two used last, each with up to a batch
  // more.
  EXPECT_LE(store_.rows_in_memory(), 3 * (kSegment + 100));
  ExpectRead(0, 50'000);
  EXPECT_LE(store_.rows_in_memory(), 3 * (kSegment + 100));
}

TEST_F(JournalStoreTest, HoldsWhatTheJournalDoesNotKeepYet) {
  while (store_.rows() < 3 * kSegment) Append(100);
  store_.Release(0);
  EXPECT_EQ(store_.rows_in_memory(), store_.rows());
  // The journal keeps one batch less than the first segment has.
  store_.Release(kSegment / 100);
  EXPECT_EQ(store_.rows_in_memory(), store_.rows());
}

TEST_F(JournalStoreTest, KnowsOfRunsThatEndWithoutARow) {
  Append(static_cast<int>(kSegment));
  Append(0, 0, /*end_of_run=*/true);
  store_.Release(sequence_);
  ExpectRead(kSegment - 5, 5);
  Append(static_cast<int>(kSegment), 1);
  Append(3, 1);
  store_.Release(sequence_);
  ExpectRead(0, store_.rows());
}

TEST_F(JournalStoreTest, SaysThatItsSessionHasBeenDeleted) {
  for (int batch = 0; batch < 4; ++batch) Append(static_cast<int>(kSegment));
  store_.Release(sequence_);
  ASSERT_TRUE(journal_.Delete(number_).ok());
  RowBlock block;
  EXPECT_TRUE(absl::IsNotFound(store_.Read(0, 1, block)));
}

}  // namespace
}  // namespace polyest::internal
