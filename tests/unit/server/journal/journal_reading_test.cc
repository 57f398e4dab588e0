// Tests that reading a long session holds up nobody.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "server/journal/sqlite_journal.h"
#include "tests/testing/problem_json.h"
#include "tests/testing/test_folder.h"
#include "tests/unit/server/journal/append_batch.h"

namespace polyest::internal {
namespace {

class JournalReadingTest : public testing::Test {
 protected:
  void SetUp() override { journal_ = SqliteJournal::Open({.folder = folder_.path()}).value(); }

  int64_t Create(const std::string& name) { return CreateIn(*journal_, name, SmallProblem()); }
  absl::Status Append(int64_t session, int64_t sequence, size_t rows = 1) {
    v1::Measurements batch;
    for (size_t row = 0; row < rows; ++row) batch.add_time_s(static_cast<double>(row + 1));
    return AppendTo(*journal_, session, sequence, batch);
  }
  uintmax_t LogBytes() const { return std::filesystem::file_size(folder_ / "journal.db-wal"); }

  const TestFolder folder_;
  std::unique_ptr<SqliteJournal> journal_;
};

// Those who read may take their time over each batch; the log becomes short meanwhile, and no
// writer waits for them.
TEST_F(JournalReadingTest, KeepsTheWriteAheadLogShortWhileALongSessionIsRead) {
  const int64_t read = Create("sessions/read"), written = Create("sessions/written");
  constexpr int kBatches = 400;  // 8 kB each
  for (int64_t sequence = 1; sequence <= kBatches; ++sequence) {
    ASSERT_TRUE(Append(read, sequence, 1'000).ok());
  }
  std::chrono::steady_clock::duration longest{};
  int64_t sequence = 0;
  int in_the_middle = 0, shortened = 0;
  const auto append = [&] {
    const auto begin = std::chrono::steady_clock::now();
    ASSERT_TRUE(Append(written, ++sequence, 50'000).ok());
    longest = std::max(longest, std::chrono::steady_clock::now() - begin);
  };
  const absl::Status status = journal_->ReadBatches(read, 0, [&](const JournalBatch& batch) {
    if (batch.sequence != 2 && batch.sequence != kBatches / 2) return absl::OkStatus();
    ++in_the_middle;
    for (int i = 0; i < 200 && LogBytes() < 3'000'000; ++i) append();
    for (int i = 0; i < 200 && LogBytes() >= 3'000'000; ++i) append();
    shortened += LogBytes() < 3'000'000 ? 1 : 0;
    return absl::OkStatus();
  });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(in_the_middle, 2);
  EXPECT_EQ(shortened, 2);
  EXPECT_LT(longest, std::chrono::milliseconds(kBusyTimeoutMs));
}

TEST_F(JournalReadingTest, ReadsTheBatchesThatThereAreWhenItBegins) {
  const int64_t session = Create("sessions/a");
  for (const int64_t sequence : {1, 2}) ASSERT_TRUE(Append(session, sequence, 20'000).ok());
  std::vector<int64_t> read;
  const absl::Status status = journal_->ReadBatches(session, 0, [&](const JournalBatch& batch) {
    read.push_back(batch.sequence);
    return batch.sequence == 1 ? Append(session, 3) : absl::OkStatus();
  });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_THAT(read, testing::ElementsAre(1, 2));
}

TEST_F(JournalReadingTest, SaysThatASessionIsDeletedWhileItIsRead) {
  const int64_t session = Create("sessions/a");
  for (const int64_t sequence : {1, 2}) ASSERT_TRUE(Append(session, sequence, 20'000).ok());
  int read = 0;
  const absl::Status status = journal_->ReadBatches(session, 0, [&](const JournalBatch&) {
    ++read;
    return journal_->Delete(session);
  });
  EXPECT_TRUE(absl::IsNotFound(status)) << status;
  EXPECT_EQ(read, 1);
}

}  // namespace
}  // namespace polyest::internal
