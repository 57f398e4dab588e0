// Tests what the journal does on a full disk: it refuses batches, loses nothing, still deletes, and
// goes on by itself when there is room.

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>

#include "server/journal/sqlite_journal.h"
#include "tests/testing/problem_json.h"
#include "tests/testing/small_disk.h"
#include "tests/unit/server/journal/append_batch.h"

namespace polyest::internal {
namespace {

namespace fs = std::filesystem;

constexpr int kDiskMb = 32;
// More attempts than the journal's own threads take to make room.
constexpr int kAttempts = 200'000;

class FullDiskTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!disk_.mounted()) GTEST_SKIP() << "only root can mount a small disk";
    Open();
  }
  void Open() {
    journal_ = nullptr;
    auto opened = SqliteJournal::Open(
        {.folder = disk_ / "data", .on_commit = [this](const CommitReport& commit) {
           ready_ = commit.outcome.ok() && commit.room;
         }});
    ASSERT_TRUE(opened.ok()) << opened.status();
    journal_ = *std::move(opened);
  }
  int64_t Create(const std::string& name) { return CreateIn(*journal_, name, SmallProblem()); }
  absl::Status Append(int64_t session, int64_t sequence, int rows = 5'000) {
    v1::Measurements batch;
    for (int row = 0; row < rows; ++row) batch.add_time_s(row + 1);
    return AppendTo(*journal_, session, sequence, batch);  // 8 bytes a row
  }
  // Appends batches until one is refused, and returns how many were kept.
  int64_t AppendAll(int64_t session, int64_t kept = 0) {
    absl::Status last;
    while (last.ok()) {
      last = Append(session, kept + 1);
      kept += last.ok() ? 1 : 0;
    }
    EXPECT_TRUE(IsDiskFull(last)) << last;
    return kept;
  }
  // Tries a batch until it is kept.
  absl::Status AppendWhenThereIsRoom(int64_t session, int64_t sequence, int rows = 5'000) {
    absl::Status appended = DiskFull();
    for (int i = 0; i < kAttempts && !appended.ok(); ++i)
      appended = Append(session, sequence, rows);
    return appended;
  }
  absl::Status CreateWhenThereIsRoom(const std::string& name) {
    SessionHead head;
    head.tenant = "t";
    head.name = name;
    absl::Status created = DiskFull();
    for (int i = 0; i < kAttempts && !created.ok(); ++i) {
      created = journal_->Create(head, SmallProblem(), /*hidden=*/false).status();
    }
    return created;
  }
  int64_t Count(int64_t session) {
    int64_t batches = 0;
    const absl::Status read = journal_->ReadBatches(session, 0, [&](const JournalBatch&) {
      ++batches;
      return absl::OkStatus();
    });
    EXPECT_TRUE(read.ok()) << read;
    return batches;
  }
  uintmax_t BytesOf(const std::string& file) const { return fs::file_size(disk_ / "data/" + file); }

  const SmallDisk disk_{kDiskMb};
  std::unique_ptr<SqliteJournal> journal_;
  std::atomic<bool> ready_ = false;
};

TEST_F(FullDiskTest, HoldsAReserve) {
  EXPECT_GT(BytesOf("reserve"), uintmax_t{kDiskMb << 20} / 10);
  EXPECT_EQ(fs::status(disk_ / "data/reserve").permissions(), fs::perms(0600));
}

TEST_F(FullDiskTest, DeletesAndGoesOnInTheRoomOfTheDeletedSession) {
  const int64_t other = Create("sessions/b"), full = Create("sessions/a");
  ASSERT_TRUE(Append(other, 1).ok());
  const int64_t kept = AppendAll(full);
  EXPECT_GT(kept, 100);
  EXPECT_EQ(Count(full), kept);
  ASSERT_TRUE(journal_->Delete(full).ok());
  // The batches of the deleted session are removed piece by piece.
  for (int64_t sequence = 2; sequence <= 50; ++sequence) {
    const absl::Status again = AppendWhenThereIsRoom(other, sequence);
    ASSERT_TRUE(again.ok()) << again;
  }
  // The removal of the next piece may need all room for a moment.
  int64_t last = 50;
  for (int i = 0; i < kAttempts && !ready_; ++i) last += Append(other, last + 1, 1).ok() ? 1 : 0;
  EXPECT_TRUE(ready_);
  // The disk can be filled and freed again and again.
  const int64_t next = AppendAll(other, last);
  EXPECT_EQ(Count(other), next);
  // The reserve may not have been whole yet, so that the log must be made short first.
  absl::Status deleted = DiskFull();
  for (int i = 0; i < kAttempts && IsDiskFull(deleted); ++i) deleted = journal_->Delete(other);
  EXPECT_TRUE(deleted.ok()) << deleted;
  EXPECT_TRUE(CreateWhenThereIsRoom("sessions/c").ok());
}

TEST_F(FullDiskTest, CopiesTheWriteAheadLogAndMakesItShort) {
  const int64_t session = Create("sessions/a");
  for (int64_t sequence = 1; sequence <= 20; ++sequence) {
    ASSERT_TRUE(Append(session, sequence).ok());
  }
  disk_.Fill();
  const int64_t kept = AppendAll(session, 20);
  for (int i = 0; i < kAttempts && BytesOf("journal.db-wal") > 0; ++i) {
    EXPECT_FALSE(journal_->CheckWritable().ok());
  }
  EXPECT_EQ(BytesOf("journal.db-wal"), 0u);
  EXPECT_EQ(Count(session), kept);
}

TEST_F(FullDiskTest, GoesOnWhenOthersHaveMadeRoomAndHoldsAReserveAgain) {
  const int64_t session = Create("sessions/a");
  const uintmax_t reserve = BytesOf("reserve");
  disk_.Fill();
  const int64_t kept = AppendAll(session);
  EXPECT_EQ(BytesOf("reserve"), 0u);
  disk_.Free();
  EXPECT_TRUE(Append(session, kept + 1).ok());
  EXPECT_EQ(BytesOf("reserve"), reserve);
  EXPECT_TRUE(journal_->CheckWritable().ok());
  EXPECT_EQ(Count(session), kept + 1);
}

TEST_F(FullDiskTest, IsOpenedOnAFullDisk) {
  const int64_t session = Create("sessions/a");
  disk_.Fill();
  const int64_t kept = AppendAll(session);
  Open();
  EXPECT_EQ(Count(session), kept);
  EXPECT_TRUE(IsDiskFull(Append(session, kept + 1)));
  EXPECT_FALSE(ready_);
  EXPECT_TRUE(journal_->Delete(session).ok());
}

TEST_F(FullDiskTest, DeletesBesideBatchesThatAreRefused) {
  const int64_t deleted = Create("sessions/a"), streamed = Create("sessions/b");
  disk_.Fill();
  const int64_t kept = AppendAll(deleted);
  EXPECT_GE(kept, 0);
  // Both are in one commit, or in two.
  std::promise<absl::Status> refused;
  JournalEntry entry;
  entry.session = streamed;
  entry.place.sequence = 1;
  journal_->Append(std::move(entry),
                   [&](const absl::Status& status) { refused.set_value(status); });
  EXPECT_TRUE(journal_->Delete(deleted).ok());
  EXPECT_TRUE(IsDiskFull(refused.get_future().get()));
}

}  // namespace
}  // namespace polyest::internal
