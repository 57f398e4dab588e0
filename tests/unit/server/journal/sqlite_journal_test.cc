#include "server/journal/sqlite_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <sstream>

#include "server/digest/digest.h"
#include "server/journal/sqlite_schema.h"
#include "tests/testing/problem_json.h"
#include "tests/testing/test_folder.h"
#include "tests/unit/server/journal/append_batch.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

// Returns who may do what with a file or folder.
fs::perms ModeOf(const std::string& path) { return fs::status(path).permissions(); }
constexpr fs::perms kOpenFolder = fs::perms(0755);
constexpr fs::perms kOpenFile = fs::perms(0644);
const std::vector<std::string> kFiles{"lock", "journal.db", "journal.db-wal", "journal.db-shm"};

class SqliteJournalTest : public testing::Test {
 protected:
  absl::Status Open(int64_t max_mb = 0) {
    journal_ = nullptr;
    auto opened = SqliteJournal::Open({.folder = folder_.path(), .max_mb = max_mb});
    if (!opened.ok()) return opened.status();
    journal_ = *std::move(opened);
    return absl::OkStatus();
  }
  int64_t Create(const std::string& name, bool hidden = false) {
    return CreateIn(*journal_, name, SmallProblem(), hidden);
  }
  absl::Status Append(int64_t session, int64_t sequence, size_t rows = 1) {
    v1::Measurements batch;
    for (size_t row = 0; row < rows; ++row) batch.add_time_s(static_cast<double>(row + 1));
    return AppendTo(*journal_, session, sequence, batch);
  }
  absl::StatusOr<int> CountBatches(int64_t session) {
    int batches = 0;
    const absl::Status read = journal_->ReadBatches(session, 0, [&](const JournalBatch&) {
      ++batches;
      return absl::OkStatus();
    });
    if (!read.ok()) return read;
    return batches;
  }
  void Write(const std::string& text) { std::ofstream(file_, std::ios::binary) << text; }
  std::string Read() {
    std::ostringstream text;
    text << std::ifstream(file_, std::ios::binary).rdbuf();
    return text.str();
  }
  // Expects a refusal with these words that leaves the file as it was.
  void ExpectRefused(absl::StatusCode code, const std::string& words) {
    const std::string before = Read();
    const absl::Status refused = Open();
    EXPECT_EQ(refused.code(), code) << refused;
    EXPECT_THAT(std::string(refused.message()), HasSubstr(file_ + ": "));
    EXPECT_THAT(std::string(refused.message()), HasSubstr(words));
    EXPECT_EQ(Read(), before);
  }
  void Change(const std::string& sql) {
    auto database = SqliteDatabase::Open(file_);
    ASSERT_TRUE(database.ok());
    ASSERT_TRUE((*database)->Execute(sql).ok());
  }

  TestFolder folder_;
  const std::string file_ = folder_ / "journal.db";
  std::unique_ptr<SqliteJournal> journal_;
};

TEST_F(SqliteJournalTest, HasWhatItHadWhenItIsOpenedAgain) {
  ASSERT_TRUE(Open().ok());
  const int64_t number = Create("sessions/a");
  ASSERT_TRUE(Append(number, 1).ok());
  ASSERT_TRUE(Append(number, 2).ok());
  journal_->SaveSnapshot(number, {2, 2, "state"});
  ASSERT_TRUE(Open().ok());
  ASSERT_EQ(journal_->Heads()->size(), 1u);
  EXPECT_EQ(journal_->Heads()->front().number, number);
  EXPECT_EQ(*CountBatches(number), 2);
  EXPECT_EQ((*journal_->ReadSnapshot(number))->state, "state");
  EXPECT_TRUE(absl::IsFailedPrecondition(Append(number, 2)));
  EXPECT_TRUE(Append(number, 3).ok());
}

TEST_F(SqliteJournalTest, MakesItsFolder) {
  const auto opened = SqliteJournal::Open({.folder = folder_ / "a/b"});
  EXPECT_TRUE(opened.ok()) << opened.status();
  EXPECT_TRUE(std::filesystem::exists(folder_ / "a/b/journal.db"));
  const absl::Status refused = SqliteJournal::Open({.folder = "/dev/null/x"}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("cannot make the folder /dev/null/x"));
}

TEST_F(SqliteJournalTest, LeavesAFolderToOneDaemon) {
  ASSERT_TRUE(Open().ok());
  const absl::Status second = SqliteJournal::Open({.folder = folder_.path()}).status();
  EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(second.message()), HasSubstr("another daemon uses the folder"));
}

TEST_F(SqliteJournalTest, IsUsedByOneDaemonAlthoughTheLockWasRemoved) {
  ASSERT_TRUE(Open().ok());
  const int64_t session = Create("sessions/a");
  fs::remove(folder_ / "lock");
  const absl::Status second = SqliteJournal::Open({.folder = folder_.path()}).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(second)) << second;
  EXPECT_THAT(std::string(second.message()), HasSubstr("though not the lock beside it"));
  // The attempt has not taken the locks of SQLite away.
  EXPECT_TRUE(Append(session, 1).ok());
}

TEST_F(SqliteJournalTest, KeepsNoFieldsThatItDoesNotKnow) {
  ASSERT_TRUE(Open().ok());
  const int64_t session = Create("sessions/a");
  v1::Measurements batch;
  batch.add_time_s(1);
  v1::Measurements stuffed = batch;
  stuffed.add_channels()->set_name("x");
  *batch.add_channels() = stuffed.channels(0);
  google::protobuf::UnknownFieldSet& unknown =
      *stuffed.channels(0).GetReflection()->MutableUnknownFields(stuffed.mutable_channels(0));
  unknown.AddLengthDelimited(999, std::string(1 << 20, 'x'));
  ASSERT_GT(stuffed.ByteSizeLong(), size_t{1} << 20);
  ASSERT_TRUE(AppendTo(*journal_, session, 1, stuffed).ok());
  // A client that repeats the batch without them repeats the same batch.
  EXPECT_EQ(journal_->ReadDigest(session, 1).value(), Digest(DeterministicBytes(batch)));
  ASSERT_TRUE(journal_
                  ->ReadBatches(session, 0,
                                [&](const JournalBatch& kept) {
                                  EXPECT_LT(kept.measurements.ByteSizeLong(), 100u);
                                  return absl::OkStatus();
                                })
                  .ok());
}

TEST_F(SqliteJournalTest, RefusesAFileThatIsNoDatabase) {
  Write(std::string(5'000, 'x'));
  ExpectRefused(absl::StatusCode::kDataLoss, "file is not a database");
}

TEST_F(SqliteJournalTest, RefusesTheDatabaseOfAnotherProgram) {
  Change("CREATE TABLE other (x); PRAGMA user_version = 1");
  ExpectRefused(absl::StatusCode::kFailedPrecondition, "is a database of another program");
}

TEST_F(SqliteJournalTest, RefusesTheFormatOfALaterVersion) {
  ASSERT_TRUE(Open().ok());
  journal_ = nullptr;
  Change("PRAGMA user_version = 99");
  ExpectRefused(absl::StatusCode::kFailedPrecondition,
                "has the format 99 of a later version of polyest");
}

TEST_F(SqliteJournalTest, RefusesATruncatedFile) {
  ASSERT_TRUE(Open().ok());
  ASSERT_TRUE(Append(Create("sessions/a"), 1, 10'000).ok());
  journal_ = nullptr;
  std::filesystem::resize_file(file_, 4'096);
  ASSERT_FALSE(Open().ok() && journal_->Heads().ok());
}

TEST_F(SqliteJournalTest, BringsAFileOfTheFirstFormatUpToDate) {
  {
    auto database = SqliteDatabase::Open(file_);
    ASSERT_TRUE(PrepareSchema(**database, 1).ok());
    ASSERT_FALSE((*database)->Execute("SELECT * FROM snapshot").ok());
    ASSERT_TRUE((*database)
                    ->Execute("INSERT INTO session VALUES (5, 't', 'sessions/old', 0, 1, 2, x'');"
                              "INSERT INTO batch VALUES (5, 1, x'', x'', 3, 4, 0, 0.5)")
                    .ok());
  }
  ASSERT_TRUE(Open().ok());
  const SessionHead head = journal_->Heads()->front();
  EXPECT_EQ(head.name, "sessions/old");
  EXPECT_EQ(head.place.rows, 4);
  EXPECT_EQ(head.reorder_window_s, 0);
  journal_->SaveSnapshot(5, {1, 4, "state"});
  ASSERT_TRUE(Append(5, 2).ok());
  EXPECT_EQ((*journal_->ReadSnapshot(5))->state, "state");
}

TEST_F(SqliteJournalTest, SaysWhichBatchIsDamagedAndLeavesTheOthersAlone) {
  ASSERT_TRUE(Open().ok());
  const int64_t a = Create("sessions/a"), b = Create("sessions/b");
  for (const int64_t sequence : {1, 2, 3}) {
    ASSERT_TRUE(Append(a, sequence).ok());
    ASSERT_TRUE(Append(b, sequence).ok());
  }
  Change("UPDATE batch SET measurements = x'00' WHERE sequence = 2 AND session = " +
         std::to_string(a));
  Change("DELETE FROM batch WHERE sequence = 2 AND session = " + std::to_string(b));
  const int64_t c = Create("sessions/c");
  ASSERT_TRUE(Append(c, 1).ok());
  EXPECT_EQ(CountBatches(a).status(),
            absl::DataLossError("batch 2 of the session is damaged or missing in the journal"));
  EXPECT_EQ(CountBatches(b).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(*CountBatches(c), 1);
}

TEST_F(SqliteJournalTest, ReadsNothingOfADeletedSessionWhoseBatchesAreStillToBeRemoved) {
  ASSERT_TRUE(Open().ok());
  const int64_t number = Create("sessions/a");
  for (const int64_t sequence : {1, 2, 3}) ASSERT_TRUE(Append(number, sequence).ok());
  // The file is as in the middle of the removal, which goes on only when the journal is opened
  // again.
  Change(
      "DELETE FROM session; DELETE FROM batch WHERE sequence = 1; "
      "INSERT INTO deleted VALUES (" +
      std::to_string(number) + ")");
  EXPECT_TRUE(absl::IsNotFound(CountBatches(number).status()));
  EXPECT_TRUE(absl::IsNotFound(Append(number, 4)));
}

TEST_F(SqliteJournalTest, RefusesWhatDoesNotFitOnTheDiskAndKeepsTheRest) {
  ASSERT_TRUE(Open(/*max_mb=*/1).ok());
  const int64_t number = Create("sessions/a");
  int64_t kept = 0;
  absl::Status last;
  while (last.ok() && kept < 100) {
    last = Append(number, kept + 1, 5'000);  // 40 kB
    if (last.ok()) ++kept;
  }
  EXPECT_EQ(last.code(), absl::StatusCode::kResourceExhausted) << last;
  EXPECT_GT(kept, 10);
  EXPECT_EQ(*CountBatches(number), kept);
  // A deletion makes room.
  const int64_t other = Create("sessions/b");
  EXPECT_EQ(Append(other, 1, 20'000).code(), absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(journal_->Delete(number).ok());
  ASSERT_TRUE(Open(/*max_mb=*/1).ok());
  absl::Status again;
  // The batches of a deleted session are removed a few at a time, in the background.
  for (int i = 0; i < 1'000; ++i) {
    again = Append(other, 1, 20'000);
    if (again.ok()) break;
  }
  EXPECT_TRUE(again.ok()) << again;
}

TEST_F(SqliteJournalTest, CanBeWrittenAsLongAsThereIsRoom) {
  ASSERT_TRUE(Open(/*max_mb=*/1).ok());
  EXPECT_TRUE(journal_->CheckWritable().ok());
  const int64_t number = Create("sessions/a");
  int64_t kept = 0;
  while (kept < 100 && Append(number, kept + 1, 5'000).ok()) ++kept;
  EXPECT_EQ(journal_->CheckWritable().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(*CountBatches(number), kept);
}

TEST_F(SqliteJournalTest, TellsOfEachCommitBeforeThoseWhoWaitForIt) {
  std::vector<CommitReport> commits;
  auto opened =
      SqliteJournal::Open({.folder = folder_.path(), .on_commit = [&](const CommitReport& commit) {
                             commits.push_back(commit);
                           }});
  ASSERT_TRUE(opened.ok()) << opened.status();
  journal_ = *std::move(opened);
  const int64_t number = Create("sessions/a");
  ASSERT_EQ(commits.size(), 1u);
  ASSERT_TRUE(Append(number, 1).ok());
  ASSERT_EQ(commits.size(), 2u);
  EXPECT_EQ(commits[1].writes, 1u);
  EXPECT_TRUE(commits[1].outcome.ok());
  EXPECT_GT(commits[1].duration.count(), 0);
  journal_ = nullptr;  // reports commits until its end
}

TEST_F(SqliteJournalTest, ForgetsAnImportThatWasNotFinished) {
  ASSERT_TRUE(Open().ok());
  const int64_t hidden = Create("sessions/a", /*hidden=*/true);
  ASSERT_TRUE(Append(hidden, 1).ok());
  ASSERT_TRUE(Open().ok());
  EXPECT_TRUE(journal_->Heads()->empty());
  EXPECT_TRUE(absl::IsNotFound(journal_->ReadProblem(hidden).status()));
  EXPECT_NE(Create("sessions/a"), hidden);
}

TEST_F(SqliteJournalTest, KeepsTheWriteAheadLogShort) {
  ASSERT_TRUE(Open().ok());
  const int64_t number = Create("sessions/a");
  const auto log_size = [&] { return fs::file_size(file_ + "-wal"); };
  int64_t sequence = 1;
  while (log_size() < 3'000'000 && sequence < 1'000)
    ASSERT_TRUE(Append(number, sequence++, 5'000).ok());
  // Another thread copies the log into the file once it has passed 4 MB, while batches go on.
  while (log_size() > 3'000'000 && sequence < 50'000) {
    ASSERT_TRUE(Append(number, sequence++, 100).ok());
  }
  EXPECT_LT(log_size(), uintmax_t{3'000'000});
  EXPECT_GT(fs::file_size(file_), uintmax_t{2'000'000});
}

TEST_F(SqliteJournalTest, IsMadeForItsOwnerOnlyWhateverTheUmask) {
  const std::string folder = folder_ / "a/b/";
  const mode_t umask_before = umask(0);
  const auto journal = SqliteJournal::Open({.folder = folder});
  umask(umask_before);
  ASSERT_TRUE(journal.ok()) << journal.status();
  EXPECT_EQ(ModeOf(folder), fs::perms(0700));
  for (const std::string& file : kFiles) EXPECT_EQ(ModeOf(folder + file), fs::perms(0600)) << file;
}

TEST_F(SqliteJournalTest, IsClosedToOthersWhereAnOlderVersionLeftItOpen) {
  ASSERT_TRUE(Open().ok());
  const int64_t session = Create("sessions/a");
  // The files are as after a crash: the log is still there.
  const TestFolder folder;
  const std::string copy = folder / "copy";
  fs::copy(folder_.path(), copy);
  fs::permissions(copy, kOpenFolder);
  for (const std::string& file : kFiles) fs::permissions(copy + "/" + file, kOpenFile);
  const auto opened = SqliteJournal::Open({.folder = copy});
  ASSERT_TRUE(opened.ok()) << opened.status();
  EXPECT_EQ(ModeOf(copy), fs::perms(0700));
  for (const std::string& file : kFiles) {
    EXPECT_EQ(ModeOf(copy + "/" + file), fs::perms(0600)) << file;
  }
  EXPECT_TRUE((*opened)->ReadProblem(session).ok());
}

TEST_F(SqliteJournalTest, RefusesAnOpenFolderThatOthersMayUseForSomethingElse) {
  folder_.Write("notes.txt", "for all");
  fs::permissions(folder_.path(), kOpenFolder);
  const absl::Status refused = Open();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(refused.message(), "the folder " + folder_.path() +
                                   " is open to other users (mode 0755) and holds other files "
                                   "(notes.txt); chmod 0700 it, or give the daemon a folder of its "
                                   "own");
  EXPECT_EQ(ModeOf(folder_.path()), kOpenFolder);
  fs::permissions(folder_.path(), fs::perms(0700));
  EXPECT_TRUE(Open().ok());
}

}  // namespace
}  // namespace polyest::internal
