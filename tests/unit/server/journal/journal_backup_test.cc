// Tests that a backup has everything that was acknowledged, whatever is written meanwhile, and that
// what is wrong with a backup is noticed.

#include "server/journal/journal_backup.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "polyest/v1/estimate.pb.h"
#include "server/journal/journal_check.h"
#include "server/journal/memory_journal.h"
#include "server/journal/sqlite_journal.h"
#include "tests/testing/problem_json.h"
#include "tests/testing/test_folder.h"
#include "tests/unit/server/journal/append_batch.h"

namespace polyest::internal {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class JournalBackupTest : public testing::Test {
 protected:
  void SetUp() override { journal_ = SqliteJournal::Open({.folder = folder_.path()}).value(); }

  absl::Status Append(int64_t session, int64_t sequence, int rows = 1) {
    v1::Measurements batch;
    for (int row = 0; row < rows; ++row) {
      batch.add_time_s(static_cast<double>(sequence) + 1e-6 * row);
    }
    return AppendTo(*journal_, session, sequence, batch);
  }
  // Makes a backup and writes it into a file of a folder for restored journals.
  std::string BackUp() {
    const auto backup = journal_->BackUp(Stop());
    EXPECT_TRUE(backup.ok()) << backup.status();
    if (!backup.ok()) return "";
    contents_ = (*backup)->contents();
    fs::create_directory(restored_);
    const std::string file = restored_ + "/journal.db";
    std::ofstream out(file, std::ios::binary);
    for (int64_t at = 0; at < (*backup)->bytes(); at += 1 << 20) {
      out << (*backup)->Read(at, 1 << 20).value();
    }
    return file;
  }
  static int64_t CountBatches(SqliteJournal& journal, int64_t session) {
    int64_t batches = 0;
    EXPECT_TRUE(journal
                    .ReadBatches(session, 0,
                                 [&](const JournalBatch& batch) {
                                   EXPECT_EQ(batch.sequence, ++batches);
                                   return absl::OkStatus();
                                 })
                    .ok());
    return batches;
  }

  const TestFolder folder_;
  const TestFolder parent_;
  const std::string restored_ = parent_ / "restored";
  std::unique_ptr<SqliteJournal> journal_;
  JournalContents contents_;
};

TEST_F(JournalBackupTest, HasWhatWasAcknowledgedAndIsServedAgain) {
  const int64_t a = CreateIn(*journal_, "sessions/a", SmallProblem());
  const int64_t b = CreateIn(*journal_, "sessions/b", SmallProblem());
  CreateIn(*journal_, "sessions/hidden", SmallProblem(), /*hidden=*/true);
  for (int i = 1; i <= 5; ++i) ASSERT_TRUE(Append(a, i, i == 3 ? 100'000 : 1).ok());
  const std::string file = BackUp();
  EXPECT_EQ(contents_.sessions, 2);
  EXPECT_EQ(contents_.batches, 5);
  EXPECT_THAT(contents_.damage, IsEmpty());
  const auto checked = CheckJournalFile(file);
  ASSERT_TRUE(checked.ok()) << checked.status();
  EXPECT_EQ(checked->batches, 5);
  EXPECT_THAT(checked->damage, IsEmpty());
  const auto restored = SqliteJournal::Open({.folder = restored_}).value();
  EXPECT_THAT(restored->damage(), IsEmpty());
  EXPECT_EQ(restored->Heads()->size(), 2u);
  EXPECT_EQ(CountBatches(*restored, a), 5);
  EXPECT_EQ(CountBatches(*restored, b), 0);
}

TEST_F(JournalBackupTest, LeavesNothingInTheFolder) {
  BackUp();
  std::ofstream(folder_ / "backup.db") << "of a daemon that was killed";
  journal_ = nullptr;
  journal_ = SqliteJournal::Open({.folder = folder_.path()}).value();
  for (const auto& entry : fs::directory_iterator(folder_.path())) {
    EXPECT_THAT(entry.path().filename().string(), testing::Not(HasSubstr("backup")));
  }
}

TEST_F(JournalBackupTest, EndsWhileBatchesArriveAndHasAllOfBefore) {
  const int64_t session = CreateIn(*journal_, "sessions/a", SmallProblem());
  // 8 MB: some steps of the copy.
  int64_t sequence = 0;
  while (sequence < 50) ASSERT_TRUE(Append(session, ++sequence, 20'000).ok());
  std::atomic<int64_t> acknowledged = sequence;
  std::jthread writer([&](std::stop_token stop) {
    while (!stop.stop_requested()) {
      ASSERT_TRUE(Append(session, ++sequence).ok());
      acknowledged = sequence;
      acknowledged.notify_all();
    }
  });
  acknowledged.wait(50);
  const int64_t before = acknowledged;
  BackUp();
  acknowledged.wait(acknowledged);
  writer.request_stop();
  writer.join();
  EXPECT_GE(contents_.batches, before);
  EXPECT_LE(contents_.batches, sequence);
  EXPECT_THAT(contents_.damage, IsEmpty());
  const auto restored = SqliteJournal::Open({.folder = restored_}).value();
  EXPECT_EQ(CountBatches(*restored, session), contents_.batches);
}

TEST_F(JournalBackupTest, BringsItsSealsSoThatLaterLossesAreNoticed) {
  const int64_t session = CreateIn(*journal_, "sessions/a", SmallProblem());
  for (int i = 1; i <= 5; ++i) ASSERT_TRUE(Append(session, i).ok());
  const std::string file = BackUp();
  SqliteDatabase::Open(file).value()->Execute("DELETE FROM batch WHERE sequence > 3").IgnoreError();
  EXPECT_THAT(
      CheckJournalFile(file)->damage,
      ElementsAre("sessions/a of tenant t: batches 4 to 5 were acknowledged and are missing"));
  const auto restored = SqliteJournal::Open({.folder = restored_}).value();
  EXPECT_THAT(
      restored->damage(),
      ElementsAre("sessions/a of tenant t: batches 4 to 5 were acknowledged and are missing"));
}

TEST_F(JournalBackupTest, TellsOfDamage) {
  const int64_t session = CreateIn(*journal_, "sessions/a", SmallProblem());
  for (int i = 1; i <= 5; ++i) ASSERT_TRUE(Append(session, i).ok());
  const std::string file = BackUp();
  {
    const auto database = SqliteDatabase::Open(file).value();
    ASSERT_TRUE(database->Execute("UPDATE batch SET measurements = x'00' WHERE sequence = 2").ok());
  }
  EXPECT_THAT(CheckJournalFile(file)->damage,
              ElementsAre("sessions/a of tenant t: batch 2 is damaged or missing"));
  // A file that was cut off.
  fs::resize_file(file, fs::file_size(file) / 2);
  const auto cut = CheckJournalFile(file);
  EXPECT_TRUE(!cut.ok() || !cut->damage.empty());
  std::ofstream(file) << "no database at all, whatever its name says, and long enough to be read";
  EXPECT_TRUE(absl::IsDataLoss(CheckJournalFile(file).status()));
  EXPECT_TRUE(absl::IsNotFound(CheckJournalFile(file + "-none").status()));
}

TEST_F(JournalBackupTest, TellsOfAnotherHistoryOfEstimates) {
  const int64_t session = CreateIn(*journal_, "sessions/a", SmallProblem());
  ASSERT_TRUE(Append(session, 1).ok());
  v1::EstimateHistory::Point point;
  point.set_time_s(1);
  journal_->SaveHistoryPoint(session, {0, 1, point.SerializeAsString()}, 1);
  ASSERT_TRUE(Append(session, 2).ok());  // behind the point
  const std::string file = BackUp();
  ASSERT_THAT(CheckJournalFile(file)->damage, IsEmpty());
  const auto change = [&](const std::string& statement) {
    const auto database = SqliteDatabase::Open(file).value();
    EXPECT_TRUE(database->Execute(statement).ok());
    return CheckJournalFile(file)->damage;
  };
  point.set_time_s(2);
  EXPECT_THAT(change(absl::StrCat("UPDATE history SET point = x'",
                                  absl::BytesToHexString(point.SerializeAsString()), "'")),
              ElementsAre("sessions/a of tenant t: its history of estimates is not the one of the "
                          "backup"));
  EXPECT_THAT(
      change("UPDATE history SET point = x'ff'"),
      ElementsAre("sessions/a of tenant t: a point of its history of estimates is damaged"));
  EXPECT_THAT(change("DELETE FROM history"),
              ElementsAre("sessions/a of tenant t: its history of estimates is not the one of the "
                          "backup"));
}

TEST_F(JournalBackupTest, IsMadeOneAtATime) {
  {
    const auto first = journal_->BackUp(Stop());
    ASSERT_TRUE(first.ok());
    EXPECT_TRUE(absl::IsResourceExhausted(journal_->BackUp(Stop()).status()));
  }
  EXPECT_TRUE(journal_->BackUp(Stop()).ok());
}

TEST_F(JournalBackupTest, EndsEarlyWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(absl::IsCancelled(journal_->BackUp(Stop(stop.get_token())).status()));
  EXPECT_TRUE(journal_->BackUp(Stop()).ok());
}

TEST(MemoryJournalBackup, IsRefused) {
  EXPECT_TRUE(absl::IsFailedPrecondition(MemoryJournal().BackUp(Stop()).status()));
}

}  // namespace
}  // namespace polyest::internal
