// Tests that damage to the journal's files is noticed.

#include "server/journal/session_seals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>

#include "server/digest/digest.h"
#include "server/journal/sqlite_journal.h"
#include "server/journal/sqlite_schema.h"
#include "tests/testing/problem_json.h"
#include "tests/testing/test_folder.h"
#include "tests/unit/server/journal/append_batch.h"

namespace polyest::internal {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(SessionSeals, AreThereAgainInTheirPlaces) {
  const TestFolder folder;
  Seal seal = Seal::At(7, "sessions/a of tenant t", std::string(32, 'h'), 4);
  seal.Add(5, "five");
  {
    const auto seals = SessionSeals::Open(folder / "seals").value();
    EXPECT_TRUE(seals->made());
    seals->Put(Seal::At(3, "sessions/b", "", 0));
    seals->Put(Seal::At(7, "", "", 0));
    seals->Put(seal);
    seals->Remove(3);
    seals->Put(Seal::At(9, std::string(500, 'x'), "", 0));
  }
  EXPECT_EQ(fs::file_size(folder / "seals"), 2 * 256u);
  EXPECT_EQ(fs::status(folder / "seals").permissions(), fs::perms(0600));
  const auto seals = SessionSeals::Open(folder / "seals").value();
  EXPECT_FALSE(seals->made());
  EXPECT_EQ(seals->All().size(), 2u);
  EXPECT_EQ(seals->Of(7)->label, seal.label);
  EXPECT_EQ(seals->Of(7)->head, seal.head);
  EXPECT_EQ(seals->Of(7)->from, 4);
  EXPECT_EQ(seals->Of(7)->sequence, 5);
  EXPECT_EQ(seals->Of(7)->chain, Digest(std::string(32, '\0') + "five"));
  EXPECT_FALSE(seals->Of(3));
  EXPECT_EQ(seals->damaged(), 0);
}

TEST(SessionSeals, AreNotBelievedWithABitFlipped) {
  const TestFolder folder;
  SessionSeals::Open(folder / "seals").value()->Put(Seal::At(7, "sessions/a", "", 4));
  std::fstream file(folder / "seals", std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(17);
  file.put('\x01');
  file.close();
  const auto seals = SessionSeals::Open(folder / "seals").value();
  EXPECT_EQ(seals->damaged(), 1);
  EXPECT_THAT(seals->All(), IsEmpty());
}

TEST(SessionSeals, BeginAnewAfterAGap) {
  Seal seal = Seal::At(1, "", "", 0);
  seal.Add(1, "one");
  seal.Add(1, "other");
  EXPECT_EQ(seal.from, 0);
  EXPECT_EQ(seal.chain, Digest(std::string(32, '\0') + "other"));
  seal.Add(5, "five");
  EXPECT_EQ(seal.from, 4);
  EXPECT_EQ(seal.chain, Digest(std::string(32, '\0') + "five"));
}

class DamagedJournalTest : public testing::Test {
 protected:
  void SetUp() override { Open(folder_.path()); }
  void Open(const std::string& folder) {
    journal_ = nullptr;
    auto opened = SqliteJournal::Open({.folder = folder});
    ASSERT_TRUE(opened.ok()) << opened.status();
    journal_ = *std::move(opened);
  }
  int64_t Create(const std::string& name, bool hidden = false) {
    return CreateIn(*journal_, name, SmallProblem(), hidden);
  }
  absl::Status Append(int64_t session, int64_t sequence, double time_s = 1) {
    v1::Measurements batch;
    batch.add_time_s(time_s);
    return AppendTo(*journal_, session, sequence, batch);
  }
  absl::Status Read(int64_t session) {
    return journal_->ReadBatches(session, 0, [](const JournalBatch&) { return absl::OkStatus(); });
  }
  // Copies the folder as it is, as if the daemon had been killed now.
  std::string Copy() {
    const std::string copy = folder_ / ("copy-" + std::to_string(++copies_));
    fs::create_directory(copy);
    for (const char* name : {"journal.db", "journal.db-wal", "seals"}) {
      fs::copy(folder_ / name, copy + "/" + name);
    }
    fs::permissions(copy, fs::perms(0700));
    return copy;
  }
  static void Change(const std::string& folder, const std::string& sql) {
    auto database = SqliteDatabase::Open(folder + "/journal.db");
    ASSERT_TRUE(database.ok() && (*database)->Execute(sql).ok());
  }

  TestFolder folder_;
  int copies_ = 0;
  std::unique_ptr<SqliteJournal> journal_;
};

TEST_F(DamagedJournalTest, SaysWhichBatchesAreMissingWhereTheLogEndsEarly) {
  const int64_t a = Create("sessions/a"), b = Create("sessions/b");
  for (const int64_t sequence : {1, 2, 3}) ASSERT_TRUE(Append(a, sequence).ok());
  ASSERT_TRUE(Append(b, 1).ok());
  const auto before = fs::file_size(folder_ / "journal.db-wal");
  ASSERT_TRUE(Append(a, 4).ok());
  ASSERT_TRUE(Append(a, 5).ok());
  const int64_t c = Create("sessions/c");
  ASSERT_TRUE(Append(c, 1).ok());
  const std::string copy = Copy();
  Open(folder_.path());
  EXPECT_THAT(journal_->damage(), IsEmpty());
  // SQLite ends the log at a frame whose checksum is wrong.
  std::fstream log(copy + "/journal.db-wal", std::ios::in | std::ios::out | std::ios::binary);
  log.seekp(static_cast<std::streamoff>(before) + 100);
  log.write("damage", 6);
  log.close();
  for (int start = 0; start < 2; ++start) {
    Open(copy);
    EXPECT_THAT(journal_->damage(),
                ElementsAre("sessions/a of tenant t: batches 4 to 5 were acknowledged and are "
                            "missing",
                            "sessions/c of tenant t: it was acknowledged with 1 batches and is "
                            "missing"));
  }
  EXPECT_TRUE(Read(a).ok());
  // What takes the place of the lost batches ends the matter.
  ASSERT_TRUE(Append(a, 4).ok());
  EXPECT_EQ(Create("sessions/d"), c);
  Open(copy);
  EXPECT_THAT(journal_->damage(), IsEmpty());
  EXPECT_TRUE(Read(a).ok());
}

TEST_F(DamagedJournalTest, NoticesALogThatIsGone) {
  const int64_t a = Create("sessions/a");
  ASSERT_TRUE(Append(a, 1).ok());
  Open(folder_.path());  // the log is in the database now
  ASSERT_TRUE(Append(a, 2).ok());
  const std::string copy = Copy();
  fs::remove(copy + "/journal.db-wal");
  Open(copy);
  EXPECT_THAT(journal_->damage(), ElementsAre(HasSubstr("batches 2 to 2 were acknowledged")));
}

TEST_F(DamagedJournalTest, ServesNothingOfASessionWhoseBatchesWereExchanged) {
  const int64_t a = Create("sessions/a"), b = Create("sessions/b");
  for (const int64_t sequence : {1, 2, 3}) {
    ASSERT_TRUE(Append(a, sequence, static_cast<double>(sequence)).ok());
    ASSERT_TRUE(Append(b, sequence, 10 + static_cast<double>(sequence)).ok());
  }
  EXPECT_TRUE(Read(a).ok());
  Change(folder_.path(),
         "UPDATE batch SET measurements = (SELECT measurements FROM batch AS other WHERE session = "
         "2 AND sequence = 2), digest = (SELECT digest FROM batch AS other WHERE session = 2 AND "
         "sequence = 2) WHERE session = 1 AND sequence = 2");
  EXPECT_EQ(Read(a), absl::DataLossError("batches 1 to 3 of the session are not those that were "
                                         "acknowledged"));
  EXPECT_TRUE(Read(b).ok());
}

TEST_F(DamagedJournalTest, ServesNoProblemWithABitFlipped) {
  const int64_t a = Create("sessions/a"), b = Create("sessions/b");
  ASSERT_TRUE(journal_->ReadProblem(a).ok());
  // The prior's upper bound becomes 1.5 + 2⁻⁵⁰: still a good problem.
  v1::Problem problem = SmallProblem();
  problem.mutable_uncertain(0)->mutable_uniform()->set_upper(std::nextafter(1.5, 2));
  const std::string bytes = DeterministicBytes(problem);
  std::string hex;
  for (const char c : bytes) {
    static constexpr char kDigits[] = "0123456789abcdef";
    hex += kDigits[static_cast<unsigned char>(c) >> 4];
    hex += kDigits[static_cast<unsigned char>(c) & 15];
  }
  Change(folder_.path(), "UPDATE session SET problem = x'" + hex + "' WHERE number = 1");
  const absl::Status refused = journal_->ReadProblem(a).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("sessions/a is damaged in the journal"));
  EXPECT_TRUE(journal_->ReadProblem(b).ok());
  Open(folder_.path());
  EXPECT_THAT(journal_->damage(), ElementsAre(HasSubstr("sessions/a of tenant t: its name, its")));
}

TEST_F(DamagedJournalTest, NoticesEveryOtherDamageToAHead) {
  for (const char* change :
       {"name = 'sessions/b'", "tenant = 'u'", "created_s = 1", "created_ns = 1",
        "reorder_window_s = 0.5", "hidden = 1", "digest = x'00'"}) {
    const int64_t number = Create("sessions/a");
    Change(folder_.path(), std::string("UPDATE session SET ") + change);
    EXPECT_TRUE(absl::IsDataLoss(journal_->ReadProblem(number).status())) << change;
    Open(folder_.path());
    EXPECT_EQ(journal_->damage().size(), 1u) << change;
    EXPECT_EQ(journal_->Heads()->size(), 1u) << change;  // it is not deleted either
    ASSERT_TRUE(journal_->Delete(number).ok());
  }
}

TEST_F(DamagedJournalTest, TellsOfNothingAfterDeletionsAndUnfinishedImports) {
  const int64_t a = Create("sessions/a");
  ASSERT_TRUE(Append(a, 1).ok());
  ASSERT_TRUE(Append(Create("sessions/b", /*hidden=*/true), 1).ok());
  const int64_t shown = Create("sessions/c", /*hidden=*/true);
  ASSERT_TRUE(journal_->Show(shown).ok());
  const std::string copy = Copy();
  ASSERT_TRUE(journal_->Delete(a).ok());
  // As after a crash before the seal was taken away: the seals are those of before.
  fs::copy(copy + "/seals", folder_ / "before");
  journal_ = nullptr;
  fs::rename(folder_ / "before", folder_ / "seals");
  Change(folder_.path(), "INSERT OR IGNORE INTO deleted VALUES (1)");
  Open(folder_.path());
  EXPECT_THAT(journal_->damage(), IsEmpty());
  EXPECT_TRUE(journal_->ReadProblem(shown).ok());
  Open(folder_.path());
  EXPECT_THAT(journal_->damage(), IsEmpty());
}

TEST_F(DamagedJournalTest, BringsSealsUpToDateThatAPowerFailureLeftBehind) {
  const int64_t a = Create("sessions/a");
  ASSERT_TRUE(Append(a, 1).ok());
  const std::string copy = Copy();
  ASSERT_TRUE(Append(a, 2).ok());
  ASSERT_TRUE(Append(a, 3).ok());
  journal_ = nullptr;
  fs::copy(copy + "/seals", folder_ / "seals", fs::copy_options::overwrite_existing);
  Open(folder_.path());
  EXPECT_THAT(journal_->damage(), IsEmpty());
  ASSERT_TRUE(Append(a, 4).ok());
  EXPECT_TRUE(Read(a).ok());
  journal_ = nullptr;
  const auto seal = SessionSeals::Open(folder_ / "seals").value()->Of(a);
  EXPECT_EQ(seal->from, 0);
  EXPECT_EQ(seal->sequence, 4);
}

TEST_F(DamagedJournalTest, BelievesNoSealOfAnotherSessionOfTheSameNumber) {
  const int64_t a = Create("sessions/a");
  for (const int64_t sequence : {1, 2, 3}) ASSERT_TRUE(Append(a, sequence).ok());
  // The database of another folder is restored into this one.
  const TestFolder other;
  Open(other.path());
  const int64_t b = Create("sessions/b");
  ASSERT_EQ(b, a);
  for (const int64_t sequence : {1, 2, 3, 4}) ASSERT_TRUE(Append(b, sequence, 7).ok());
  journal_ = nullptr;
  fs::copy(folder_ / "seals", other / "seals", fs::copy_options::overwrite_existing);
  Open(other.path());
  EXPECT_THAT(journal_->damage(), IsEmpty());
  EXPECT_TRUE(Read(b).ok());
}

TEST_F(DamagedJournalTest, SealsWhatAnOlderVersionHasStored) {
  const TestFolder old;
  {
    auto database = SqliteDatabase::Open(old / "journal.db");
    ASSERT_TRUE(PrepareSchema(**database, 4).ok());
    ASSERT_TRUE(
        (*database)
            ->Execute("INSERT INTO session VALUES (5, 't', 'sessions/old', 0, 1, 2, x'', 0);"
                      "INSERT INTO batch VALUES (5, 1, x'', x'', 3, 4, 0, 0.5)")
            .ok());
  }
  Open(old.path());
  EXPECT_THAT(journal_->damage(), IsEmpty());
  EXPECT_TRUE(journal_->ReadProblem(5).ok());
  EXPECT_EQ(journal_->Heads()->size(), 1u);
  ASSERT_TRUE(Append(5, 2).ok());
  journal_ = nullptr;
  EXPECT_EQ(SessionSeals::Open(old / "seals").value()->Of(5)->sequence, 2);
}

}  // namespace
}  // namespace polyest::internal
