#include "server/journal/postgres_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <latch>
#include <map>

#include "proto/wire/refusal/refusal.h"
#include "server/journal/postgres_schema.h"
#include "server/journal/postgres_status.h"
#include "server/journal/postgres_target.h"
#include "server/journal/postgres_writer.h"
#include "server/journal/postgres_writes.h"
#include "tests/testing/postgres_server.h"
#include "tests/testing/problem_json.h"
#include "tests/unit/server/journal/append_batch.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

v1::Measurements RowAt(double time, size_t bytes = 0) {
  v1::Measurements rows;
  rows.add_time_s(time);
  if (bytes > 0) rows.add_channels()->set_name(std::string(bytes, 'x'));
  return rows;
}

class PostgresJournalTest : public testing::Test {
 protected:
  std::unique_ptr<PostgresJournal> Open(const std::string& node = "") {
    auto opened = PostgresJournal::Open({.uri = uri_, .node = node});
    EXPECT_TRUE(opened.ok()) << opened.status();
    return opened.ok() ? *std::move(opened) : nullptr;
  }
  absl::Status OpenStatus() { return PostgresJournal::Open({.uri = uri_}).status(); }
  void Execute(const std::string& sql) { server_.Execute(uri_, sql); }
  static std::vector<double> Times(const SessionJournal& journal, int64_t session) {
    std::vector<double> times;
    const absl::Status read = journal.ReadBatches(session, 0, [&](const JournalBatch& batch) {
      times.push_back(batch.measurements.time_s(0));
      return absl::OkStatus();
    });
    EXPECT_TRUE(read.ok()) << read;
    return times;
  }
  static absl::Status ReadAll(const SessionJournal& journal, int64_t session) {
    return journal.ReadBatches(session, 0, [](const JournalBatch&) { return absl::OkStatus(); });
  }

  PostgresServer& server_ = PostgresServer::Shared();
  const std::string uri_ = server_.MakeDatabase();
};

TEST_F(PostgresJournalTest, KeepsWhatWasAcknowledgedWhenTheServerCrashes) {
  const auto journal = Open();
  const int64_t session = CreateIn(*journal, "sessions/a", SmallProblem());
  ASSERT_TRUE(AppendTo(*journal, session, 1, RowAt(1)).ok());
  server_.Crash();
  // The first finds the connection lost, the second finds no server.
  for (int attempt = 0; attempt < 2; ++attempt) {
    const absl::Status away = AppendTo(*journal, session, 2, RowAt(2));
    EXPECT_TRUE(absl::IsUnavailable(away)) << away;
    EXPECT_EQ(RefusalOf(away)->reason, kDatabaseAway);
    EXPECT_TRUE(RefusalOf(away)->retry_delay.has_value());
  }
  EXPECT_TRUE(absl::IsUnavailable(journal->ReadProblem(session).status()));
  EXPECT_TRUE(absl::IsUnavailable(journal->CheckWritable()));
  server_.Start();
  absl::StatusOr<SessionPlace> place = journal->Claim(session);
  while (!place.ok()) place = journal->Claim(session);  // until the node has its lease again
  EXPECT_EQ(place->sequence, 1);
  absl::Status appended = AppendTo(*journal, session, 2, RowAt(2));
  while (absl::IsUnavailable(appended)) appended = AppendTo(*journal, session, 2, RowAt(2));
  EXPECT_TRUE(appended.ok()) << appended;
  EXPECT_THAT(Times(*journal, session), ElementsAre(1, 2));
  const absl::Status writable = journal->CheckWritable();
  EXPECT_TRUE(writable.ok()) << writable;
}

TEST_F(PostgresJournalTest, ReadsPagesWithoutAGap) {
  const auto journal = Open();
  const int64_t session = CreateIn(*journal, "sessions/a", SmallProblem());
  constexpr int64_t kBatches = 600;
  std::promise<void> all;
  std::vector<double> times;
  for (int64_t sequence = 1; sequence <= kBatches; ++sequence) {
    JournalEntry entry;
    entry.session = session;
    // Two are larger than a page may be.
    const v1::Measurements rows =
        RowAt(static_cast<double>(sequence), sequence == 3 || sequence == 300 ? 9 << 20 : 0);
    times.push_back(rows.time_s(0));
    entry.measurements = DeterministicBytes(rows);
    entry.digest = Digest(entry.measurements);
    entry.place.sequence = sequence;
    journal->Append(std::move(entry), [&, sequence](const absl::Status& kept) {
      EXPECT_TRUE(kept.ok()) << kept;
      if (sequence == kBatches) all.set_value();
    });
  }
  all.get_future().wait();
  EXPECT_EQ(Times(*journal, session), times);
}

TEST_F(PostgresJournalTest, NoticesWhatIsDamaged) {
  const auto journal = Open();
  const int64_t session = CreateIn(*journal, "sessions/a", SmallProblem());
  for (const int64_t sequence : {1, 2, 3}) {
    ASSERT_TRUE(AppendTo(*journal, session, sequence, RowAt(1)).ok());
  }
  Execute(
      "UPDATE polyest.batch SET measurements = set_byte(measurements, 3, 77) WHERE sequence = 2");
  const absl::Status damaged = ReadAll(*journal, session);
  EXPECT_TRUE(absl::IsDataLoss(damaged));
  EXPECT_THAT(damaged.message(), HasSubstr("batch 2 "));
  Execute("DELETE FROM polyest.batch WHERE sequence = 2");
  EXPECT_TRUE(absl::IsDataLoss(ReadAll(*journal, session)));
  Execute("UPDATE polyest.session SET reorder_window_s = 3");
  EXPECT_TRUE(absl::IsDataLoss(journal->ReadProblem(session).status()));
}

TEST_F(PostgresJournalTest, KeepsTheOthersOfAGroupWhenANameIsTaken) {
  const auto journal = Open();
  const int64_t a = CreateIn(*journal, "sessions/a", SmallProblem());
  const int64_t hidden = CreateIn(*journal, "sessions/a", SmallProblem(), /*hidden=*/true);
  std::promise<void> all;
  int kept = 0;
  for (int64_t sequence = 1; sequence <= 100; ++sequence) {
    JournalEntry entry;
    entry.session = a;
    entry.measurements = DeterministicBytes(RowAt(1));
    entry.digest = Digest(entry.measurements);
    entry.place.sequence = sequence;
    journal->Append(std::move(entry), [&, sequence](const absl::Status& status) {
      kept += status.ok();
      if (sequence == 100) all.set_value();
    });
    if (sequence % 10 == 0) {
      EXPECT_TRUE(absl::IsAlreadyExists(journal->Show(hidden)));
    }
  }
  all.get_future().wait();
  EXPECT_EQ(kept, 100);
}

TEST_F(PostgresJournalTest, JudgesEachBatchOfAGroup) {
  const auto journal = Open();
  constexpr int64_t kBatches = 100, kGap = 40;
  const int64_t whole = CreateIn(*journal, "sessions/whole", SmallProblem());
  const int64_t gap = CreateIn(*journal, "sessions/gap", SmallProblem());
  const int64_t taken = CreateIn(*journal, "sessions/taken", SmallProblem());
  const int64_t none = taken + 1;
  ASSERT_TRUE(AppendTo(*journal, taken, 1, RowAt(1)).ok());
  Execute("UPDATE polyest.owner SET epoch = 2 WHERE session = " + std::to_string(taken));
  std::map<int64_t, std::vector<absl::StatusCode>> outcomes;
  std::latch left(4 * kBatches);
  const auto append = [&](int64_t session, int64_t sequence) {
    journal->Append(EntryOf(session, sequence, RowAt(1, static_cast<size_t>(sequence))),
                    [&, session](const absl::Status& status) {
                      outcomes[session].push_back(status.code());
                      left.count_down();
                    });
  };
  for (int64_t sequence = 1; sequence <= kBatches; ++sequence) {
    append(whole, sequence);
    append(gap, sequence < kGap ? sequence : sequence + 1);
    append(taken, sequence + 1);
    append(none, sequence);
  }
  left.wait();
  using Code = absl::StatusCode;
  std::vector<Code> broken(kBatches, Code::kFailedPrecondition);
  std::fill_n(broken.begin(), kGap - 1, Code::kOk);
  EXPECT_EQ(outcomes[whole], std::vector<Code>(kBatches, Code::kOk));
  EXPECT_EQ(outcomes[gap], broken);
  EXPECT_EQ(outcomes[taken], std::vector<Code>(kBatches, Code::kUnavailable));
  EXPECT_EQ(outcomes[none], std::vector<Code>(kBatches, Code::kNotFound));
  EXPECT_EQ(server_.Number(uri_, "SELECT count(*) FROM polyest.batch"), kBatches + kGap - 1 + 1);
  EXPECT_EQ(server_.Number(uri_,
                           "SELECT count(*) FROM (SELECT place_bytes - sum(octet_length("
                           "measurements)) OVER (PARTITION BY session ORDER BY sequence) AS wrong "
                           "FROM polyest.batch) AS each WHERE wrong <> 0"),
            0);
}

TEST_F(PostgresJournalTest, JudgesTheBatchesOfTwoOwnersInOneGroup) {
  const auto journal = Open();
  const int64_t session = CreateIn(*journal, "sessions/a", SmallProblem());
  Execute("UPDATE polyest.owner SET epoch = 2");
  const int64_t node = server_.Number(uri_, "SELECT node FROM polyest.owner");
  const PostgresOwner before{node, 1}, now{node, 2};
  const JournalEntry first = EntryOf(session, 1, RowAt(1)), second = EntryOf(session, 2, RowAt(2)),
                     third = EntryOf(session, 3, RowAt(3));
  const auto add = [](const JournalEntry& entry, const PostgresOwner& owner) {
    return [&](PostgresWriter& writer) {
      writer.SendBatch({.entry = &entry, .last = {.bytes = entry.measurements}, .owner = owner});
      return absl::OkStatus();
    };
  };
  const auto remove = [&](const PostgresOwner& owner) {
    return [&](PostgresWriter& writer) {
      SendDelete(writer, session, owner);
      return absl::OkStatus();
    };
  };
  std::vector<absl::Status> outcomes(6);
  PostgresWriter writer(*PostgresTarget::Parse(uri_));
  const absl::Status committed = writer.Commit({add(first, before), add(first, now), remove(before),
                                                add(second, now), remove(now), add(third, now)},
                                               outcomes);
  ASSERT_TRUE(committed.ok()) << committed;
  std::vector<absl::StatusCode> codes;
  for (const absl::Status& outcome : outcomes) codes.push_back(outcome.code());
  using Code = absl::StatusCode;
  EXPECT_THAT(codes, ElementsAre(Code::kUnavailable, Code::kOk, Code::kUnavailable, Code::kOk,
                                 Code::kOk, Code::kNotFound));
}

TEST_F(PostgresJournalTest, RemovesWhatDeletedSessionsLeave) {
  const auto journal = Open();
  const int64_t session = CreateIn(*journal, "sessions/a", SmallProblem());
  for (int64_t sequence = 1; sequence <= 3; ++sequence) {
    ASSERT_TRUE(AppendTo(*journal, session, sequence, RowAt(1)).ok());
  }
  ASSERT_TRUE(AppendTo(*journal, session, 4, RowAt(1, /*bytes=*/1'000'000)).ok());
  journal->SaveSnapshot(session, {1, 1, "state"});
  ASSERT_TRUE(journal->Delete(session).ok());
  const std::string left =
      "SELECT (SELECT count(*) FROM polyest.batch) + (SELECT count(*) FROM polyest.part) + (SELECT "
      "count(*) FROM polyest.snapshot) + "
      "(SELECT count(*) FROM polyest.owner) + (SELECT count(*) FROM polyest.deleted)";
  while (server_.Number(uri_, left) > 0) {
  }
}

TEST_F(PostgresJournalTest, RefusesTheSchemasOfOthers) {
  Execute("CREATE SCHEMA polyest");
  EXPECT_TRUE(absl::IsFailedPrecondition(OpenStatus()));
  Execute("DROP SCHEMA polyest");
  ASSERT_TRUE(OpenStatus().ok());
  Execute("UPDATE polyest.schema_version SET version = version + 1");
  const absl::Status later = OpenStatus();
  EXPECT_TRUE(absl::IsFailedPrecondition(later));
  EXPECT_THAT(later.message(), HasSubstr("of a later version of polyest"));
}

TEST_F(PostgresJournalTest, SaysWhenTheUserMayNotMakeTheSchema) {
  Execute("CREATE ROLE nobody_" +
          uri_.substr(uri_.find("test"), uri_.find('?') - uri_.find("test")) + " LOGIN");
  std::string uri = uri_;
  const std::string name = uri_.substr(uri_.find("test"), uri_.find('?') - uri_.find("test"));
  uri.replace(uri.find("user=polyest"), 12, "user=nobody_" + name);
  const absl::Status refused = PostgresJournal::Open({.uri = uri}).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(refused)) << refused;
  EXPECT_THAT(refused.message(), HasSubstr("permission denied"));
}

TEST_F(PostgresJournalTest, AdvisesTheDatabasesOwnBackup) {
  const absl::Status refused = Open()->BackUp(Stop()).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(refused));
  EXPECT_THAT(refused.message(), HasSubstr("pg_basebackup"));
}

TEST_F(PostgresJournalTest, RefusesTheBatchesOfADaemonThatHasLostTheSession) {
  const auto first = Open();
  const auto second = Open();
  second->Announce("127.0.0.1:2");
  const int64_t session = CreateIn(*first, "sessions/a", SmallProblem());
  ASSERT_TRUE(AppendTo(*first, session, 1, RowAt(1)).ok());
  // The first daemon lets go behind its own back, as one that was stopped past its lease.
  Execute("UPDATE polyest.owner SET node = NULL");
  EXPECT_EQ(second->Claim(session)->sequence, 1);
  ASSERT_TRUE(AppendTo(*second, session, 2, RowAt(2)).ok());
  const absl::Status fenced = AppendTo(*first, session, 3, RowAt(30));
  EXPECT_TRUE(absl::IsUnavailable(fenced)) << fenced;
  EXPECT_EQ(RefusalOf(fenced)->reason, kOwnedElsewhere);
  first->SaveSnapshot(session, {1, 1, "stale"});
  first->SaveHistoryPoint(session, {0, 1, "stale"}, 1);
  EXPECT_THAT(*first->ReadHistory(session), IsEmpty());
  EXPECT_TRUE(absl::IsUnavailable(first->Delete(session)));
  EXPECT_EQ(*second->ReadSnapshot(session), std::nullopt);
  EXPECT_THAT(Times(*second, session), ElementsAre(1, 2));
}

TEST_F(PostgresJournalTest, TellsThePlaceOfASessionThatIsClaimed) {
  const auto journal = Open();
  const int64_t session = CreateIn(*journal, "sessions/a", SmallProblem());
  EXPECT_EQ(journal->Claim(session)->sequence, 0);
  JournalEntry entry;
  entry.session = session;
  entry.place = {1, 4, 2, {1, 1.5}};
  std::promise<absl::Status> kept;
  journal->Append(entry, [&](const absl::Status& status) { kept.set_value(status); });
  ASSERT_TRUE(kept.get_future().get().ok());
  const auto place = journal->Claim(session);
  ASSERT_TRUE(place.ok()) << place.status();
  EXPECT_EQ(place->sequence, 1);
  EXPECT_EQ(place->samples, 4);
  EXPECT_EQ(place->rows, 2);
  EXPECT_EQ(place->last_row.run, 1);
  EXPECT_EQ(place->last_row.time_s, 1.5);
  EXPECT_TRUE(journal->Owns(session));
  EXPECT_TRUE(absl::IsNotFound(journal->Claim(session + 1).status()));
}

TEST_F(PostgresJournalTest, KeepsNoBatchOfTheTimeBeforeAClaim) {
  const auto journal = Open();
  const int64_t session = CreateIn(*journal, "sessions/a", SmallProblem());
  // The lock stands for a commit of which the daemon does not know the outcome.
  Execute("UPDATE polyest.owner SET epoch = epoch + 1");
  EXPECT_TRUE(absl::IsUnavailable(AppendTo(*journal, session, 1, RowAt(1))));
  EXPECT_EQ(journal->Claim(session)->sequence, 0);
  EXPECT_TRUE(AppendTo(*journal, session, 1, RowAt(2)).ok());
  EXPECT_THAT(Times(*journal, session), ElementsAre(2));
}

TEST_F(PostgresJournalTest, NamesTheOwnerOfASessionAndWaitsUntilItLetsGo) {
  const auto first = Open();
  const auto second = Open();
  first->Announce("rig-host:50051");
  const int64_t session = CreateIn(*first, "sessions/a", SmallProblem());
  absl::Status owned = second->Claim(session).status();
  // The address is in the database as soon as the first has told it.
  while (RefusalOf(owned)->owner.empty()) owned = second->Claim(session).status();
  EXPECT_TRUE(absl::IsUnavailable(owned));
  EXPECT_EQ(RefusalOf(owned)->reason, kOwnedElsewhere);
  EXPECT_EQ(RefusalOf(owned)->owner, "rig-host:50051");
  EXPECT_THAT(owned.message(), HasSubstr("rig-host:50051"));
  EXPECT_TRUE(absl::IsUnavailable(second->HeadOf("t", "sessions/a").status()));
  EXPECT_FALSE(second->Owns(session));
  first->Release(session);
  EXPECT_FALSE(first->Owns(session));
  EXPECT_EQ((*second->HeadOf("t", "sessions/a"))->number, session);
  EXPECT_TRUE(second->Claim(session).ok());
  EXPECT_EQ(*second->HeadOf("t", "sessions/b"), std::nullopt);
}

TEST_F(PostgresJournalTest, TakesTheSessionsOfItsEarlierRunAtOnce) {
  auto other = Open("here:1");
  const int64_t session = CreateIn(*other, "sessions/a", SmallProblem());
  CreateIn(*other, "sessions/b", SmallProblem(), /*hidden=*/true);
  ASSERT_TRUE(AppendTo(*other, session, 1, RowAt(1)).ok());
  // The earlier run is still there, as if it had been stopped.
  const auto journal = Open("here:1");
  // Until it listens it may have been started by mistake, and takes nothing.
  EXPECT_TRUE(absl::IsUnavailable(journal->Claim(session).status()));
  EXPECT_TRUE(AppendTo(*other, session, 2, RowAt(2)).ok());
  journal->Announce("here:1");
  absl::StatusOr<SessionPlace> place = journal->Claim(session);
  while (absl::IsUnavailable(place.status())) place = journal->Claim(session);
  EXPECT_EQ(place->sequence, 2);
  while (server_.Number(uri_, "SELECT count(*) FROM polyest.session") > 1) continue;
  EXPECT_EQ(server_.Number(uri_, "SELECT count(*) FROM polyest.session"), 1);
  EXPECT_TRUE(absl::IsUnavailable(AppendTo(*other, session, 3, RowAt(3))));
}

TEST(PostgresTargetTest, TakesNoPasswordAndRepeatsNone) {
  for (const char* uri :
       {"postgresql://user:hunter2@host/db", "postgresql://host/db?password=hunter2",
        "postgresql://user:hunter2/x@host:port/db", "postgresql://host/db?hunter2",
        "mysql://user:hunter2@host/db"}) {
    const absl::Status refused = PostgresTarget::Parse(uri).status();
    EXPECT_TRUE(absl::IsInvalidArgument(refused)) << uri;
    EXPECT_THAT(refused.message(), Not(HasSubstr("hunter2")));
  }
  const auto target =
      PostgresTarget::Parse("postgresql://me@a:1,b:2/db?passfile=/etc/pass&sslmode=verify-full");
  EXPECT_TRUE(target.ok()) << target.status();
}

TEST(PostgresStatusTest, MapsTheStatesOfTheServer) {
  EXPECT_TRUE(absl::IsUnavailable(FromSqlState("57P01", "going down")));
  EXPECT_TRUE(absl::IsUnavailable(FromSqlState("57014", "time-out")));
  EXPECT_TRUE(absl::IsUnavailable(FromSqlState("25006", "read-only")));
  EXPECT_TRUE(absl::IsUnavailable(FromSqlState("40P01", "deadlock")));
  EXPECT_TRUE(absl::IsResourceExhausted(FromSqlState("53100", "disk full")));
  EXPECT_EQ(RefusalOf(FromSqlState("53100", "disk full"))->reason, kDiskFull);
  EXPECT_TRUE(absl::IsAlreadyExists(FromSqlState("23505", "taken")));
  EXPECT_TRUE(absl::IsDataLoss(FromSqlState("XX001", "damaged")));
  EXPECT_TRUE(absl::IsInternal(FromSqlState("42601", "syntax")));
}

}  // namespace
}  // namespace polyest::internal
