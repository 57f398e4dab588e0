// Tests what every journal does.

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <future>

#include "server/digest/digest.h"
#include "server/journal/memory_journal.h"
#include "server/journal/postgres_journal.h"
#include "server/journal/sqlite_journal.h"
#include "tests/testing/postgres_server.h"
#include "tests/testing/problem_json.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;

SessionHead Head(const std::string& tenant, const std::string& name) {
  SessionHead head;
  head.tenant = tenant;
  head.name = name;
  head.create_time.set_seconds(7);
  head.create_time.set_nanos(9);
  head.reorder_window_s = 0.25;
  return head;
}

JournalEntry Entry(int64_t session, int64_t sequence, double time) {
  v1::Measurements rows;
  rows.add_time_s(time);
  JournalEntry entry;
  entry.session = session;
  entry.measurements = DeterministicBytes(rows);
  entry.digest = Digest(entry.measurements);
  entry.place = {sequence, 2 * sequence, sequence, {1, time}};
  return entry;
}

enum class Kind { kMemory, kSqlite, kPostgres };

std::string NameOf(Kind kind) {
  if (kind == Kind::kMemory) return "Memory";
  return kind == Kind::kSqlite ? "Sqlite" : "Postgres";
}

class JournalContractTest : public testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    if (GetParam() == Kind::kMemory) {
      journal_ = std::make_unique<MemoryJournal>();
    } else if (GetParam() == Kind::kPostgres) {
      auto opened = PostgresJournal::Open({.uri = PostgresServer::Shared().MakeDatabase()});
      ASSERT_TRUE(opened.ok()) << opened.status();
      journal_ = *std::move(opened);
    } else {
      auto opened = SqliteJournal::Open({.folder = folder_.path()});
      ASSERT_TRUE(opened.ok()) << opened.status();
      journal_ = *std::move(opened);
    }
  }
  int64_t Create(const std::string& tenant, const std::string& name, bool hidden = false) {
    const auto number = journal_->Create(Head(tenant, name), SmallProblem(), hidden);
    EXPECT_TRUE(number.ok()) << number.status();
    return number.value_or(0);
  }
  absl::Status Append(const JournalEntry& entry) {
    std::promise<absl::Status> kept;
    journal_->Append(entry, [&](const absl::Status& status) { kept.set_value(status); });
    return kept.get_future().get();
  }
  std::vector<double> Times(int64_t session, int64_t after = 0) {
    std::vector<double> times;
    const absl::Status read = journal_->ReadBatches(session, after, [&](const JournalBatch& batch) {
      EXPECT_EQ(batch.sequence, after + 1 + static_cast<int64_t>(times.size()));
      times.push_back(batch.measurements.time_s(0));
      return absl::OkStatus();
    });
    EXPECT_TRUE(read.ok()) << read;
    return times;
  }
  std::vector<std::string> Names() {
    std::vector<std::string> names;
    const auto heads = journal_->Heads();
    EXPECT_TRUE(heads.ok()) << heads.status();
    for (const SessionHead& head : *heads) names.push_back(head.tenant + ":" + head.name);
    return names;
  }

  TestFolder folder_;
  std::unique_ptr<SessionJournal> journal_;
};

TEST_P(JournalContractTest, KeepsAHeadAndItsProblem) {
  const int64_t number = Create("t", "sessions/a");
  const auto heads = journal_->Heads();
  ASSERT_EQ(heads->size(), 1u);
  EXPECT_EQ(heads->front().number, number);
  EXPECT_EQ(heads->front().create_time.seconds(), 7);
  EXPECT_EQ(heads->front().create_time.nanos(), 9);
  EXPECT_EQ(heads->front().place.sequence, 0);
  EXPECT_EQ(heads->front().reorder_window_s, 0.25);
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(*journal_->ReadProblem(number),
                                                                 SmallProblem()));
}

TEST_P(JournalContractTest, ListsInTheOrderOfTenantsAndNames) {
  Create("t", "sessions/b");
  Create("s", "sessions/c");
  Create("t", "sessions/a");
  EXPECT_THAT(Names(), ElementsAre("s:sessions/c", "t:sessions/a", "t:sessions/b"));
}

TEST_P(JournalContractTest, HasANameOnceInATenant) {
  Create("t", "sessions/a");
  Create("s", "sessions/a");
  EXPECT_TRUE(absl::IsAlreadyExists(
      journal_->Create(Head("t", "sessions/a"), SmallProblem(), false).status()));
}

TEST_P(JournalContractTest, KeepsBatchesInOrderAndSaysWhereTheyLed) {
  const int64_t a = Create("t", "sessions/a"), b = Create("t", "sessions/b");
  for (const int64_t sequence : {1, 2, 3}) {
    EXPECT_TRUE(Append(Entry(a, sequence, 0.5 * static_cast<double>(sequence))).ok());
  }
  EXPECT_TRUE(Append(Entry(b, 1, 9)).ok());
  EXPECT_THAT(Times(a), ElementsAre(0.5, 1, 1.5));
  EXPECT_THAT(Times(a, 2), ElementsAre(1.5));
  EXPECT_THAT(Times(b), ElementsAre(9));
  const SessionPlace place = journal_->Heads()->front().place;
  EXPECT_EQ(place.sequence, 3);
  EXPECT_EQ(place.samples, 6);
  EXPECT_EQ(place.rows, 3);
  EXPECT_EQ(place.last_row.run, 1);
  EXPECT_EQ(place.last_row.time_s, 1.5);
  EXPECT_EQ(*journal_->ReadDigest(a, 2), Entry(a, 2, 1).digest);
  EXPECT_TRUE(absl::IsNotFound(journal_->ReadDigest(a, 4).status()));
}

TEST_P(JournalContractTest, NeverLeavesAGapNorKeepsABatchTwice) {
  const int64_t number = Create("t", "sessions/a");
  EXPECT_TRUE(absl::IsFailedPrecondition(Append(Entry(number, 2, 1))));
  EXPECT_TRUE(Append(Entry(number, 1, 1)).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(Append(Entry(number, 1, 1))));
  EXPECT_TRUE(absl::IsFailedPrecondition(Append(Entry(number, 3, 1))));
  EXPECT_THAT(Times(number), ElementsAre(1));
}

TEST_P(JournalContractTest, KeepsBatchesThatAreLargerThanACommit) {
  const int64_t number = Create("t", "sessions/a");
  constexpr int kRows = 100'000;  // 800 kB
  const auto large = [&](int64_t sequence) {
    v1::Measurements rows;
    for (int row = 1; row <= kRows; ++row) rows.add_time_s(static_cast<double>(sequence) * row);
    JournalEntry entry = Entry(number, sequence, 1);
    entry.measurements = DeterministicBytes(rows);
    entry.digest = Digest(entry.measurements);
    return entry;
  };
  // Nobody waits for one before the next is appended.
  std::promise<void> all;
  for (const int64_t sequence : {1, 2, 3}) {
    journal_->Append(sequence == 2 ? Entry(number, 2, 2) : large(sequence),
                     [&, sequence](const absl::Status& kept) {
                       EXPECT_TRUE(kept.ok()) << kept;
                       if (sequence == 3) all.set_value();
                     });
  }
  all.get_future().wait();
  EXPECT_TRUE(absl::IsFailedPrecondition(Append(large(3))));
  EXPECT_TRUE(absl::IsFailedPrecondition(Append(large(5))));
  std::vector<std::string> kept;
  const absl::Status read = journal_->ReadBatches(number, 0, [&](const JournalBatch& batch) {
    kept.push_back(DeterministicBytes(batch.measurements));
    return absl::OkStatus();
  });
  EXPECT_TRUE(read.ok()) << read;
  EXPECT_TRUE((kept == std::vector{large(1).measurements, Entry(number, 2, 2).measurements,
                                   large(3).measurements}));
  EXPECT_EQ(journal_->Heads()->front().bytes,
            static_cast<int64_t>(DeterministicBytes(SmallProblem()).size() + kept[0].size() +
                                 kept[1].size() + kept[2].size()));
  ASSERT_TRUE(journal_->Delete(number).ok());
  EXPECT_TRUE(absl::IsNotFound(Append(large(4))));
}

TEST_P(JournalContractTest, CallsBackInTheOrderOfTheCalls) {
  const int64_t number = Create("t", "sessions/a");
  constexpr int64_t kBatches = 2'000;
  std::vector<int64_t> order;
  std::promise<void> all;
  for (int64_t sequence = 1; sequence <= kBatches; ++sequence) {
    journal_->Append(Entry(number, sequence, 1), [&, sequence](const absl::Status& kept) {
      EXPECT_TRUE(kept.ok()) << kept;
      order.push_back(sequence);
      if (sequence == kBatches) all.set_value();
    });
  }
  all.get_future().wait();
  ASSERT_EQ(order.size(), static_cast<size_t>(kBatches));
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
  EXPECT_EQ(Times(number).size(), static_cast<size_t>(kBatches));
}

TEST_P(JournalContractTest, StopsReadingWhenAskedTo) {
  const int64_t number = Create("t", "sessions/a");
  for (const int64_t sequence : {1, 2, 3}) ASSERT_TRUE(Append(Entry(number, sequence, 1)).ok());
  int read = 0;
  const absl::Status stopped = journal_->ReadBatches(number, 0, [&](const JournalBatch&) {
    ++read;
    return absl::CancelledError("enough");
  });
  EXPECT_EQ(stopped, absl::CancelledError("enough"));
  EXPECT_EQ(read, 1);
}

TEST_P(JournalContractTest, CountsTheBytesOfAProblemAndItsBatches) {
  const int64_t number = Create("t", "sessions/a");
  const auto problem = static_cast<int64_t>(DeterministicBytes(SmallProblem()).size());
  EXPECT_EQ(journal_->Heads()->front().bytes, problem);
  int64_t bytes = problem;
  for (const int64_t sequence : {1, 2, 3}) {
    const JournalEntry entry = Entry(number, sequence, static_cast<double>(sequence));
    bytes += static_cast<int64_t>(entry.measurements.size());
    ASSERT_TRUE(Append(entry).ok());
  }
  EXPECT_EQ(journal_->Heads()->front().bytes, bytes);
  EXPECT_EQ(journal_->Heads()->front().snapshot_bytes, 0);
  journal_->SaveSnapshot(number, {2, 2, std::string(1'000, 's')});
  ASSERT_TRUE(Append(Entry(number, 4, 4)).ok());  // The snapshot is stored before.
  EXPECT_EQ(journal_->Heads()->front().snapshot_bytes, 1'000);
}

TEST_P(JournalContractTest, ForgetsWhatIsDeleted) {
  const int64_t a = Create("t", "sessions/a");
  ASSERT_TRUE(Append(Entry(a, 1, 1)).ok());
  EXPECT_TRUE(journal_->Delete(a).ok());
  EXPECT_TRUE(absl::IsNotFound(journal_->Delete(a)));
  EXPECT_TRUE(absl::IsNotFound(journal_->ReadProblem(a).status()));
  EXPECT_THAT(Names(), ElementsAre());
  const int64_t again = Create("t", "sessions/a");
  EXPECT_NE(again, a);
  EXPECT_THAT(Times(again), ElementsAre());
}

TEST_P(JournalContractTest, TellsWhoReadsOrAppendsThatASessionIsNotThere) {
  const int64_t a = Create("t", "sessions/a");
  ASSERT_TRUE(Append(Entry(a, 1, 1)).ok());
  ASSERT_TRUE(journal_->Delete(a).ok());
  const auto take = [](const JournalBatch&) { return absl::OkStatus(); };
  for (const int64_t session : {a, a + 1}) {
    for (const int64_t after : {0, 1}) {
      EXPECT_TRUE(absl::IsNotFound(journal_->ReadBatches(session, after, take)));
    }
    // The batches are refused whether they would follow or not.
    for (const int64_t sequence : {1, 2, 3}) {
      EXPECT_TRUE(absl::IsNotFound(Append(Entry(session, sequence, 1))));
    }
  }
}

TEST_P(JournalContractTest, ShowsAHiddenSessionOnlyWhenTold) {
  const int64_t hidden = Create("t", "sessions/a", true);
  EXPECT_THAT(Names(), ElementsAre());
  ASSERT_TRUE(Append(Entry(hidden, 1, 1)).ok());
  EXPECT_TRUE(journal_->Show(hidden).ok());
  EXPECT_THAT(Names(), ElementsAre("t:sessions/a"));
  const int64_t second = Create("t", "sessions/a", true);
  EXPECT_TRUE(absl::IsAlreadyExists(journal_->Show(second)));
  EXPECT_TRUE(journal_->Delete(second).ok());
  EXPECT_TRUE(absl::IsNotFound(journal_->Show(second)));
}

TEST_P(JournalContractTest, HasTheLatestSnapshotOfBatchesThatItKeeps) {
  const int64_t number = Create("t", "sessions/a");
  EXPECT_EQ(*journal_->ReadSnapshot(number), std::nullopt);
  journal_->SaveSnapshot(number, {1, 1, "too early"});
  ASSERT_TRUE(Append(Entry(number, 1, 1)).ok());
  EXPECT_EQ(*journal_->ReadSnapshot(number), std::nullopt);
  const std::string state("a\0b", 3);
  journal_->SaveSnapshot(number, {1, 1, "first"});
  journal_->SaveSnapshot(number, {1, 1, state});
  // Writes are in order, so that the snapshots are there.
  ASSERT_TRUE(Append(Entry(number, 2, 2)).ok());
  const auto snapshot = *journal_->ReadSnapshot(number);
  ASSERT_TRUE(snapshot.has_value());
  EXPECT_EQ(snapshot->state, state);
  EXPECT_EQ(snapshot->sequence, 1);
  EXPECT_EQ(snapshot->rows, 1);
}

TEST_P(JournalContractTest, HasTheHistoryOfBatchesThatItKeepsAndThinsIt) {
  const int64_t number = Create("t", "sessions/a"), other = Create("t", "sessions/b");
  EXPECT_TRUE(journal_->ReadHistory(number)->empty());
  journal_->SaveHistoryPoint(number, {0, 1, "too early"}, 1);
  ASSERT_TRUE(Append(Entry(number, 1, 1)).ok());
  ASSERT_TRUE(Append(Entry(other, 1, 1)).ok());
  const std::string bytes("a\0b", 3);
  journal_->SaveHistoryPoint(number, {0, 1, bytes}, 1);
  journal_->SaveHistoryPoint(other, {3, 1, "other"}, 1);
  for (int64_t k = 1; k <= 3; ++k) journal_->SaveHistoryPoint(number, {k, 1, "point"}, 1);
  journal_->SaveHistoryPoint(number, {4, 1, "last"}, 2);
  // Writes are in order, so that the points are there.
  ASSERT_TRUE(Append(Entry(number, 2, 2)).ok());
  using Points = std::vector<JournalHistoryPoint>;
  EXPECT_EQ(*journal_->ReadHistory(number),
            (Points{{0, 1, bytes}, {2, 1, "point"}, {4, 1, "last"}}));
  EXPECT_EQ(*journal_->ReadHistory(other), (Points{{3, 1, "other"}}));
}

INSTANTIATE_TEST_SUITE_P(, JournalContractTest,
                         testing::Values(Kind::kMemory, Kind::kSqlite, Kind::kPostgres),
                         [](const auto& kind) { return NameOf(kind.param); });

}  // namespace
}  // namespace polyest::internal
