// Tests that the limits of a tenant hold over all daemons of a database.

#include <gtest/gtest.h>

#include <future>
#include <memory>

#include "server/journal/postgres_journal.h"
#include "server/sessions/session_registry.h"
#include "tests/testing/postgres_server.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

// What a daemon has of the sessions of a database.
class Daemon {
 public:
  Daemon(const std::string& uri, const std::string& node, const SessionLimits& limits)
      : journal_(PostgresJournal::Open({.uri = uri, .node = node}).value()),
        registry_(SessionRegistry::Open({.executor = executor_,
                                         .journal = *journal_,
                                         .models = models_,
                                         .limits = limits,
                                         .memory = MemoryLimit(0, [] { return 0; })},
                                        [] { return google::protobuf::Timestamp(); })
                      .value()) {}

  SessionRegistry& registry() { return *registry_; }
  absl::StatusCode Create(const std::string& id) {
    return registry_->Create("t", id, SmallProblem()).status().code();
  }
  // Adds rows as batch 1 of a session and waits until they are kept.
  absl::StatusCode Add(const std::string& id, int rows) {
    const auto session = registry_->Find("t", "sessions/" + id);
    if (!session.ok()) return session.status().code();
    const absl::Status loaded = (*session)->Load({});
    if (!loaded.ok()) return loaded.code();
    v1::Measurements batch;
    batch.add_channels()->set_name("x");
    for (int row = 1; row <= rows; ++row) {
      batch.add_time_s(row);
      batch.mutable_channels(0)->add_values(0.1);
    }
    const uint64_t losses = (*session)->losses();
    const absl::Status added = (*session)->Add(1, batch).status();
    if (!added.ok()) return added.code();
    std::promise<absl::Status> kept;
    (*session)->WhenAllKept(losses, [&](const absl::Status& status) { kept.set_value(status); });
    return kept.get_future().get().code();
  }

 private:
  Executor executor_{
      {.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10}};
  ModelLibrary models_;
  std::unique_ptr<PostgresJournal> journal_;
  std::unique_ptr<SessionRegistry> registry_;
};

constexpr auto kOk = absl::StatusCode::kOk;
constexpr auto kExhausted = absl::StatusCode::kResourceExhausted;

TEST(SharedLimits, CountTheSessionsOfAllDaemons) {
  const std::string uri = PostgresServer::Shared().MakeDatabase();
  const SessionLimits limits{.sessions_per_tenant = 3};
  Daemon a(uri, "a", limits), b(uri, "b", limits);
  EXPECT_EQ(a.Create("x"), kOk);
  EXPECT_EQ(a.Create("y"), kOk);
  EXPECT_EQ(b.Create("z"), kOk);
  b.registry().FollowOthers();
  EXPECT_EQ(b.Create("w"), kExhausted);
  EXPECT_TRUE(a.registry().Delete("t", "sessions/x").ok());
  b.registry().FollowOthers();
  EXPECT_EQ(b.Create("w"), kOk);
  a.registry().FollowOthers();
  EXPECT_EQ(a.Create("v"), kExhausted);
}

TEST(SharedLimits, CountTheRowsOfAllDaemons) {
  const std::string uri = PostgresServer::Shared().MakeDatabase();
  const SessionLimits limits{.rows_per_tenant = 10};
  Daemon a(uri, "a", limits), b(uri, "b", limits);
  ASSERT_EQ(a.Create("x"), kOk);
  ASSERT_EQ(b.Create("y"), kOk);
  ASSERT_EQ(b.Create("z"), kOk);
  b.registry().FollowOthers();
  EXPECT_EQ(a.Add("x", 6), kOk);
  EXPECT_EQ(b.Add("y", 3), kOk);
  b.registry().FollowOthers();
  EXPECT_EQ(b.Add("z", 2), kExhausted);
  EXPECT_EQ(b.Add("z", 1), kOk);
  // A tenant that has not used a daemon since is not looked at, and all that it has is counted.
  EXPECT_EQ(a.registry().services().stored->OfTenant("t").rows, 6);
  a.registry().services().stored->NoteActive("t");
  a.registry().FollowOthers();
  EXPECT_EQ(a.registry().services().stored->OfTenant("t").rows, 10);
}

}  // namespace
}  // namespace polyest::internal
