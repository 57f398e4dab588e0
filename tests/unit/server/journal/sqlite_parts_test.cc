// Tests batches that SQLite's journal keeps in parts, where parts are missing or do not fit. What
// every journal does with them is in journal_contract_test.cc.

#include "server/journal/sqlite_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "server/journal/sqlite_journal.h"
#include "tests/testing/problem_json.h"
#include "tests/testing/test_folder.h"
#include "tests/unit/server/journal/append_batch.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;

// Rows of a batch that takes more than two commits; each has 8 bytes.
constexpr size_t kRowsOfThreeParts = CommitQueue<SqliteDatabase>::kMaxBytes * 5 / 16;

v1::Measurements Rows(size_t count) {
  v1::Measurements batch;
  for (size_t row = 1; row <= count; ++row) batch.add_time_s(static_cast<double>(row));
  return batch;
}

class SqlitePartsTest : public testing::Test {
 protected:
  void Open(int64_t max_mb = 0) {
    journal_ = nullptr;
    journal_ = SqliteJournal::Open({.folder = folder_.path(), .max_mb = max_mb}).value();
  }
  int64_t Create(const std::string& name) { return CreateIn(*journal_, name, SmallProblem()); }
  absl::Status Append(int64_t session, int64_t sequence, size_t rows) {
    return AppendTo(*journal_, session, sequence, Rows(rows));
  }
  absl::StatusOr<int> CountBatches(int64_t session) {
    int batches = 0;
    const auto count = [&](const JournalBatch&) { return ++batches, absl::OkStatus(); };
    const absl::Status read = journal_->ReadBatches(session, 0, count);
    if (!read.ok()) return read;
    return batches;
  }
  void Change(const std::string& sql) {
    auto database = SqliteDatabase::Open(folder_ / "journal.db");
    ASSERT_TRUE(database.ok());
    ASSERT_TRUE((*database)->Execute(sql).ok());
  }
  int64_t CountParts() {
    const auto database = SqliteDatabase::Open(folder_ / "journal.db");
    return database.ok() ? (*database)->Number("SELECT count(*) FROM part").value_or(-1) : -1;
  }

  TestFolder folder_;
  std::unique_ptr<SqliteJournal> journal_;
};

TEST_F(SqlitePartsTest, AreForgottenWhereTheirBatchNeverCame) {
  Open();
  const int64_t number = Create("sessions/a");
  ASSERT_TRUE(Append(number, 1, kRowsOfThreeParts).ok());
  // As after a crash in the middle of batch 2, and with a rest of batch 3 of another attempt.
  Change(
      "INSERT INTO part SELECT session, 2, number, x'01' FROM part WHERE number = 1; "
      "INSERT INTO part SELECT session, 3, 7, x'01' FROM part WHERE sequence = 1 AND number = 1");
  ASSERT_TRUE(Append(number, 2, kRowsOfThreeParts).ok());
  EXPECT_EQ(*CountBatches(number), 2);
  Open();
  EXPECT_EQ(*CountBatches(number), 2);
  EXPECT_EQ(CountParts(), 4);
  Change("UPDATE part SET bytes = x'00' WHERE sequence = 2 AND number = 2");
  EXPECT_EQ(CountBatches(number).status(),
            absl::DataLossError("batch 2 of the session is damaged or missing in the journal"));
}

TEST_F(SqlitePartsTest, AreRefusedTogetherWhereTheyDoNotFit) {
  Open(/*max_mb=*/1);
  const int64_t number = Create("sessions/a");
  // The next batch is sent before the outcome is known, and its own outcome comes after it.
  std::vector<absl::StatusCode> outcomes;
  std::promise<void> both;
  for (const int64_t sequence : {1, 2}) {
    const size_t rows = sequence == 1 ? 2 * kRowsOfThreeParts : 1;
    journal_->Append(EntryOf(number, sequence, Rows(rows)),
                     [&, sequence](const absl::Status& kept) {
                       outcomes.push_back(kept.code());
                       if (sequence == 2) both.set_value();
                     });
  }
  both.get_future().wait();
  EXPECT_THAT(outcomes, ElementsAre(absl::StatusCode::kResourceExhausted,
                                    absl::StatusCode::kFailedPrecondition));
  EXPECT_EQ(*CountBatches(number), 0);
  // What is written later has the room that it has left.
  EXPECT_TRUE(Append(Create("sessions/b"), 1, kRowsOfThreeParts / 5).ok());
  EXPECT_EQ(CountParts(), 0);
  EXPECT_TRUE(Append(number, 1, 1).ok());
  EXPECT_EQ(*CountBatches(number), 1);
}

}  // namespace
}  // namespace polyest::internal
