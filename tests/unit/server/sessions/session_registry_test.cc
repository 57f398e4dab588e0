#include "server/sessions/session_registry.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "proto/wire/refusal/refusal.h"
#include "server/digest/digest.h"
#include "server/sessions/session_import.h"
#include "tests/testing/faulty_journal.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

// Adds a batch as the strand does for a call.
absl::StatusOr<v1::Acknowledgement> Add(const std::shared_ptr<Session>& session, int64_t sequence,
                                        const v1::Measurements& batch) {
  const absl::Status loaded = session->Load({});
  if (!loaded.ok()) return loaded;
  return session->Add(sequence, batch);
}

class SessionRegistryTest : public testing::Test {
 protected:
  absl::Status StatusOfCreate(const std::string& id) {
    return registry_->Create("t", id, SmallProblem()).status();
  }

  std::vector<std::string> NamesAfter(const std::string& after, size_t count) {
    std::vector<std::string> names;
    const auto page = registry_->List("t", after, count);
    EXPECT_TRUE(page.ok()) << page.status();
    for (const auto& session : *page) names.push_back(session->name());
    return names;
  }

  // Returns the head of a session without batches, which is its whole import.
  static v1::ImportSessionRequest ImportOf(const std::string& id) {
    v1::ImportSessionRequest request;
    request.set_session_id(id);
    request.mutable_record()->mutable_head()->set_problem(DeterministicBytes(SmallProblem()));
    return request;
  }

  static v1::ImportSessionRequest End() {
    v1::ImportSessionRequest request;
    request.mutable_record()->mutable_end();
    return request;
  }

  static v1::Measurements Rows(const std::vector<double>& times) {
    v1::Measurements batch;
    auto& x = *batch.add_channels();
    x.set_name("x");
    for (const double time : times) {
      batch.add_time_s(time);
      x.add_values(0.1);
    }
    return batch;
  }

  void SetUp() override { Open(); }
  void Open() {
    const SessionServices services{.executor = executor_,
                                   .journal = journal_,
                                   .models = models_,
                                   .limits = limits_,
                                   .memory = MemoryLimit(1, [this] { return resident_bytes_; })};
    auto opened = SessionRegistry::Open(services, [this] {
      google::protobuf::Timestamp time;
      time.set_seconds(wall_clock_s_);
      return time;
    });
    ASSERT_TRUE(opened.ok()) << opened.status();
    registry_ = *std::move(opened);
  }

  FaultyJournal journal_;
  Executor executor_{
      {.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10}};
  ModelLibrary models_;
  SessionLimits limits_{.sessions = 4, .sessions_per_tenant = 3};
  int64_t resident_bytes_ = 0;
  int64_t wall_clock_s_ = 42;
  std::unique_ptr<SessionRegistry> registry_;
};

TEST_F(SessionRegistryTest, KeepsWhatItCreates) {
  const auto created = registry_->Create("t", "rig-7", SmallProblem());
  ASSERT_TRUE(created.ok()) << created.status();
  EXPECT_EQ(*registry_->Get("t", "sessions/rig-7"), *created);
  const v1::Session session = (*created)->Describe();
  EXPECT_EQ(session.name(), "sessions/rig-7");
  EXPECT_EQ(session.create_time().seconds(), 42);
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(*(*created)->ReadProblem(),
                                                                 SmallProblem()));
  EXPECT_EQ(session.last_sequence(), 0);
  EXPECT_EQ(session.sample_count(), 0);
}

TEST_F(SessionRegistryTest, ChoosesNamesThatAreFree) {
  ASSERT_TRUE(StatusOfCreate("session-1").ok());
  EXPECT_EQ((*registry_->Create("t", "", SmallProblem()))->name(), "sessions/session-2");
  EXPECT_EQ((*registry_->Create("t", "", SmallProblem()))->name(), "sessions/session-3");
}

TEST_F(SessionRegistryTest, RefusesNamesThatAreTakenOrBad) {
  ASSERT_TRUE(StatusOfCreate("a").ok());
  EXPECT_EQ(StatusOfCreate("a").code(), absl::StatusCode::kAlreadyExists);
  for (const std::string& bad : {std::string("A"), std::string("1a"), std::string("-a"),
                                 std::string("a_b"), std::string("a/b"), std::string(64, 'a')}) {
    EXPECT_EQ(StatusOfCreate(bad).code(), absl::StatusCode::kInvalidArgument) << bad;
  }
  EXPECT_TRUE(StatusOfCreate(std::string(63, 'a')).ok());
}

TEST_F(SessionRegistryTest, RefusesABadProblemAndKeepsNothingOfIt) {
  EXPECT_EQ(registry_->Create("t", "a", v1::Problem()).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(registry_->Get("t", "sessions/a").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(SessionRegistryTest, KeepsNothingOfASessionWhoseCreationIsStopped) {
  const Stop past({}, Stop::Clock::now() - std::chrono::seconds(1));
  EXPECT_EQ(registry_->Create("t", "a", SmallProblem(), 0, past).status().code(),
            absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(registry_->Get("t", "sessions/a").status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(StatusOfCreate("a").ok());
}

TEST_F(SessionRegistryTest, HoldsNoMoreThanItsLimit) {
  for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(StatusOfCreate(id).ok());
  const absl::Status full = StatusOfCreate("d");
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(full.message(),
            "a tenant may have at most 3 sessions (--max-sessions-per-tenant); delete one");
  ASSERT_TRUE(registry_->Create("other", "d", SmallProblem()).ok());
  EXPECT_EQ(registry_->Create("third", "e", SmallProblem()).status().message(),
            "the daemon keeps at most 4 sessions (--max-sessions); delete one");
  ASSERT_TRUE(registry_->Delete("other", "sessions/d").ok());
  ASSERT_TRUE(registry_->Delete("t", "sessions/b").ok());
  EXPECT_TRUE(StatusOfCreate("d").ok());
}

TEST_F(SessionRegistryTest, HoldsNoMoreThanItsLimitHoweverManyImportsBeganBeforeIt) {
  limits_.sessions = 1;
  Open();
  SessionImport first(*registry_, "t"), second(*registry_, "t");
  ASSERT_TRUE(first.Take(ImportOf("a")).ok());
  ASSERT_TRUE(second.Take(ImportOf("b")).ok());
  ASSERT_TRUE(first.Take(End()).ok());
  ASSERT_TRUE(second.Take(End()).ok());
  EXPECT_TRUE(first.Finish().ok());
  EXPECT_EQ(RefusalOf(second.Finish().status())->limit, "--max-sessions");
  EXPECT_THAT(NamesAfter("", 9), testing::ElementsAre("sessions/a"));
  EXPECT_EQ(journal_.Heads()->size(), 1u);
  ASSERT_TRUE(registry_->Delete("t", "sessions/a").ok());
  EXPECT_TRUE(StatusOfCreate("b").ok());
}

TEST_F(SessionRegistryTest, HoldsFewRowsOfAnImportInMemoryAndNoneBeyondTheLimitOfMemory) {
  v1::ImportSessionRequest head = ImportOf("a");
  head.mutable_record()->mutable_head()->set_batch_count(20);
  SessionImport import(*registry_, "t");
  ASSERT_TRUE(import.Take(head).ok());
  v1::ImportSessionRequest request;
  v1::SessionRecord::Batch& batch = *request.mutable_record()->mutable_batch();
  int row = 0;
  for (int sequence = 1; sequence <= 20; ++sequence) {
    batch.set_sequence(sequence);
    batch.clear_measurements();
    auto& x = *batch.mutable_measurements()->add_channels();
    x.set_name("x");
    for (int k = 0; k < 2000; ++k) {
      batch.mutable_measurements()->add_time_s(1e-3 * ++row);
      x.add_values(0);
    }
    if (sequence == 20) {
      resident_bytes_ = int64_t{2} << 20;
      EXPECT_EQ(RefusalOf(import.Take(request))->limit, "--max-memory-mb");
    } else {
      ASSERT_TRUE(import.Take(request).ok());
    }
    EXPECT_LE(import.rows_in_memory(), 3 * (JournalStore::kSegmentRows + 2000));
  }
}

// Whoever was told that a session exists finds it, and so does the next daemon, whatever others do
// with its name at the same time.
TEST_F(SessionRegistryTest, AgreesWithTheJournalHoweverCreationsImportsAndDeletionsMeet) {
  limits_.sessions = limits_.sessions_per_tenant = 1;
  Open();
  std::atomic<int> balance = 0;
  const auto meet = [&](int seed) {
    for (int k = 0; k < 60; ++k) {
      switch ((k + seed) % 3) {
        case 0:
          balance += StatusOfCreate("a").ok() ? 1 : 0;
          break;
        case 1: {
          SessionImport import(*registry_, "t");
          const bool taken = import.Take(ImportOf("a")).ok() && import.Take(End()).ok();
          balance += taken && import.Finish().ok() ? 1 : 0;
          break;
        }
        default:
          balance -= registry_->Delete("t", "sessions/a").ok() ? 1 : 0;
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int seed = 0; seed < 4; ++seed) threads.emplace_back(meet, seed);
  }
  EXPECT_EQ(NamesAfter("", 9).size(), static_cast<size_t>(balance));
  EXPECT_EQ(journal_.Heads()->size(), static_cast<size_t>(balance));
  const bool remade = StatusOfCreate("a").ok();
  EXPECT_EQ(remade, balance == 0);
  EXPECT_TRUE(Add(*registry_->Get("t", "sessions/a"), 1, Rows({0.1})).ok());
  // The count of sessions is right, too.
  EXPECT_EQ(RefusalOf(StatusOfCreate("b"))->limit, "--max-sessions");
  ASSERT_TRUE(registry_->Delete("t", "sessions/a").ok());
  EXPECT_TRUE(StatusOfCreate("b").ok());
}

TEST_F(SessionRegistryTest, HasASessionThatTakesTheNameOfOneJustBeingDeleted) {
  limits_.sessions = 2;
  Open();
  SessionImport import(*registry_, "t");
  ASSERT_TRUE(import.Take(ImportOf("a")).ok() && import.Take(End()).ok());
  ASSERT_TRUE(StatusOfCreate("a").ok());
  const auto old = *registry_->Get("t", "sessions/a");
  journal_.AfterDeleting([&] { EXPECT_TRUE(import.Finish().ok()); });
  ASSERT_TRUE(registry_->Delete("t", "sessions/a").ok());
  const auto session = registry_->Get("t", "sessions/a");
  ASSERT_TRUE(session.ok()) << session.status();
  EXPECT_NE(*session, old);
  EXPECT_TRUE(Add(*session, 1, Rows({0.1})).ok());
  // The session counts once.
  EXPECT_TRUE(StatusOfCreate("b").ok());
  EXPECT_EQ(RefusalOf(StatusOfCreate("c"))->limit, "--max-sessions");
}

TEST_F(SessionRegistryTest, ListsInTheOrderOfNamesFromAnyPlace) {
  for (const char* id : {"c", "a", "b"}) ASSERT_TRUE(StatusOfCreate(id).ok());
  EXPECT_THAT(NamesAfter("", 2), testing::ElementsAre("sessions/a", "sessions/b"));
  EXPECT_THAT(NamesAfter("sessions/b", 2), testing::ElementsAre("sessions/c"));
  // The list may continue after a name that no longer exists.
  ASSERT_TRUE(registry_->Delete("t", "sessions/b").ok());
  EXPECT_THAT(NamesAfter("sessions/b", 2), testing::ElementsAre("sessions/c"));
}

TEST_F(SessionRegistryTest, DeletesOnce) {
  ASSERT_TRUE(StatusOfCreate("a").ok());
  EXPECT_TRUE(registry_->Delete("t", "sessions/a").ok());
  EXPECT_EQ(registry_->Delete("t", "sessions/a").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(registry_->Get("t", "sessions/a").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(SessionRegistryTest, ShowsATenantNothingOfAnother) {
  ASSERT_TRUE(StatusOfCreate("a").ok());
  ASSERT_TRUE(registry_->Create("other", "a", SmallProblem()).ok());
  ASSERT_TRUE(registry_->Create("other", "b", SmallProblem()).ok());
  EXPECT_NE(*registry_->Get("t", "sessions/a"), *registry_->Get("other", "sessions/a"));
  EXPECT_EQ(registry_->Get("t", "sessions/b").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(registry_->Delete("t", "sessions/b").code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(NamesAfter("", 9), testing::ElementsAre("sessions/a"));
}

TEST_F(SessionRegistryTest, FindsWhatTheJournalHas) {
  ASSERT_TRUE(StatusOfCreate("a").ok());
  const auto session = *registry_->Get("t", "sessions/a");
  v1::Measurements batch;
  batch.add_time_s(0.25);
  batch.add_channels()->set_name("x");
  batch.mutable_channels(0)->add_values(0.1);
  ASSERT_TRUE(session->Add(1, batch).ok());
  Open();
  const v1::Session again = (*registry_->Get("t", "sessions/a"))->Describe();
  EXPECT_EQ(again.create_time().seconds(), 42);
  EXPECT_EQ(again.last_sequence(), 1);
  EXPECT_EQ(again.sample_count(), 1);
  EXPECT_EQ(again.last_time_s(), 0.25);
  EXPECT_FALSE(again.activity().loaded());
}

TEST_F(SessionRegistryTest, ShowsATimeThatJsonDoesNotAllowAsTheNearestThatItDoes) {
  SessionHead head;
  head.tenant = "t";
  head.name = "sessions/a";
  head.create_time.set_seconds(1'000'000'000'000'000);
  ASSERT_TRUE(journal_.Create(head, SmallProblem(), /*hidden=*/false).ok());
  Open();
  const auto session = *registry_->Get("t", "sessions/a");
  EXPECT_EQ(session->Describe().create_time().seconds(), 253'402'300'799);
}

TEST_F(SessionRegistryTest, HoldsNoMoreRowsThanATenantMayHaveAlsoAfterARestart) {
  limits_.rows_per_tenant = 3;
  Open();
  ASSERT_TRUE(StatusOfCreate("a").ok());
  ASSERT_TRUE(StatusOfCreate("b").ok());
  ASSERT_TRUE(Add(*registry_->Get("t", "sessions/a"), 1, Rows({0.1, 0.2})).ok());
  Open();
  const auto b = *registry_->Get("t", "sessions/b");
  const auto refused = Add(b, 1, Rows({0.1, 0.2}));
  EXPECT_EQ(RefusalOf(refused.status())->limit, "--max-tenant-rows");
  EXPECT_TRUE(Add(b, 1, Rows({0.1})).ok());
  ASSERT_TRUE(registry_->Delete("t", "sessions/a").ok());
  EXPECT_TRUE(Add(b, 2, Rows({0.2, 0.3})).ok());
}

TEST_F(SessionRegistryTest, StoresNoMoreBytesThanATenantMayHaveAlsoAfterARestart) {
  limits_.disk_mb_per_tenant = 1;
  Open();
  ASSERT_TRUE(StatusOfCreate("a").ok());
  std::vector<double> times;
  for (int row = 1; row <= 40'000; ++row) times.push_back(0.001 * row);  // 16 bytes each
  ASSERT_TRUE(Add(*registry_->Get("t", "sessions/a"), 1, Rows(times)).ok());
  Open();
  ASSERT_TRUE(StatusOfCreate("b").ok());
  const auto b = *registry_->Get("t", "sessions/b");
  const auto refused = Add(b, 1, Rows(times));
  EXPECT_EQ(RefusalOf(refused.status())->limit, "--max-tenant-disk-mb");
  ASSERT_TRUE(registry_->Delete("t", "sessions/a").ok());
  EXPECT_TRUE(Add(b, 1, Rows(times)).ok());
}

TEST_F(SessionRegistryTest, CountsNoRowsThatWereRefused) {
  limits_.rows_per_tenant = 2;
  Open();
  ASSERT_TRUE(StatusOfCreate("a").ok());
  const auto a = *registry_->Get("t", "sessions/a");
  EXPECT_FALSE(Add(a, 1, Rows({0.2, 0.1})).ok());
  journal_.Fail(absl::ResourceExhaustedError("full"));
  EXPECT_TRUE(Add(a, 1, Rows({0.1, 0.2})).ok());  // The batch is not kept.
  journal_.Fail(absl::OkStatus());
  EXPECT_TRUE(Add(a, 1, Rows({0.1, 0.2})).ok());
}

TEST_F(SessionRegistryTest, TakesOnlyProblemsWithinItsLimits) {
  ASSERT_TRUE(StatusOfCreate("before").ok());
  limits_.problem.states = 1;
  Open();
  EXPECT_EQ(RefusalOf(StatusOfCreate("after"))->limit, "--max-states");
  // An existing session remains usable.
  EXPECT_TRUE(Add(*registry_->Get("t", "sessions/before"), 1, Rows({0.1})).ok());
}

TEST_F(SessionRegistryTest, LoadsNothingWhileMemoryIsShortAndGoesOnWithWhatIsLoaded) {
  ASSERT_TRUE(StatusOfCreate("a").ok());
  const auto a = *registry_->Get("t", "sessions/a");
  resident_bytes_ = (1 << 20) + 1;
  EXPECT_EQ(RefusalOf(StatusOfCreate("b"))->limit, "--max-memory-mb");
  // A writer that creates the session in order to go on with it learns that it exists.
  EXPECT_EQ(StatusOfCreate("a").code(), absl::StatusCode::kAlreadyExists);
  EXPECT_TRUE(Add(a, 1, Rows({0.1})).ok());
  a->Unload();
  const auto refused = Add(a, 2, Rows({0.2}));
  EXPECT_EQ(RefusalOf(refused.status())->limit, "--max-memory-mb");
  EXPECT_TRUE(RefusalOf(refused.status())->retry_delay);
  resident_bytes_ = 1 << 20;
  EXPECT_TRUE(Add(a, 2, Rows({0.2})).ok());
}

TEST_F(SessionRegistryTest, OnlyShowsTheClockOnTheWallWhichMayJump) {
  for (const auto& [id, time_s] : {std::pair("a", 1'000'000'000), {"b", -5}, {"c", 2}}) {
    wall_clock_s_ = time_s;
    ASSERT_TRUE(StatusOfCreate(id).ok());
    const auto session = *registry_->Get("t", absl::StrCat("sessions/", id));
    EXPECT_EQ(session->Describe().create_time().seconds(), time_s);
    EXPECT_TRUE(Add(session, 1, Rows({0.1})).ok());
    ASSERT_TRUE(session->IdleTime());
    EXPECT_LT(*session->IdleTime(), std::chrono::minutes(1));
    EXPECT_LT(session->Describe().activity().idle_time_s(), 60);
  }
  EXPECT_THAT(NamesAfter("", 9), testing::ElementsAre("sessions/a", "sessions/b", "sessions/c"));
  Open();
  EXPECT_THAT(NamesAfter("", 9), testing::ElementsAre("sessions/a", "sessions/b", "sessions/c"));
  EXPECT_TRUE(Add(*registry_->Get("t", "sessions/b"), 2, Rows({0.2})).ok());
}

TEST_F(SessionRegistryTest, KeepsWhatItWasWhenTheDiskFails) {
  ASSERT_TRUE(StatusOfCreate("a").ok());
  journal_.Fail(absl::ResourceExhaustedError("full"));
  EXPECT_EQ(StatusOfCreate("b").code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(registry_->Delete("t", "sessions/a").code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(NamesAfter("", 9), testing::ElementsAre("sessions/a"));
  journal_.Fail(absl::OkStatus());
  EXPECT_TRUE(StatusOfCreate("b").ok());
}

}  // namespace
}  // namespace polyest::internal
