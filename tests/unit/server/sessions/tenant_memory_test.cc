#include "server/sessions/tenant_memory.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <future>

#include "core/common/sanitizer.h"
#include "proto/wire/refusal/refusal.h"
#include "server/digest/digest.h"
#include "server/journal/memory_journal.h"
#include "server/sessions/session_import.h"
#include "server/sessions/session_registry.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

constexpr int64_t kMebibyte = int64_t{1} << 20;

// Returns a problem of two parameters of this order.
v1::Problem ProblemOfOrder(int order, int points_per_term = 2) {
  return ProblemFromJson(absl::StrCat(R"({
    "model": {"builtin": "mass_spring_damper"},
    "fixed": {"m": 1, "k": 39.478, "c": 0.2},
    "uncertain": [{"name": "v0", "uniform": {"lower": 0.5, "upper": 1.5}},
                  {"name": "x0", "uniform": {"lower": 0.5, "upper": 1.5}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}],
    "expansion": {"order": )",
                                      order, R"(, "pointsPerTerm": )", points_per_term, "}}"));
}

v1::Measurements Rows(int count) {
  v1::Measurements batch;
  auto& x = *batch.add_channels();
  x.set_name("x");
  for (int row = 1; row <= count; ++row) {
    batch.add_time_s(1e-4 * row);
    x.add_values(0.1);
  }
  return batch;
}

struct Writer : SessionObserver {
  void OnEstimate(const SharedEstimate&) override {}
  void OnClosed() override {}
};

TEST(TenantMemory, CountsEachSessionOnce) {
  TenantMemory memory(1);
  memory.Set(1, "t", 100);
  memory.Set(2, "t", 10);
  memory.Set(1, "t", 50);
  memory.Add(2, 5);
  memory.Add(3, 1000);
  EXPECT_EQ(memory.OfTenant("t"), 65);
  memory.Forget(2);
  memory.Forget(3);
  EXPECT_EQ(memory.OfTenant("t"), 50);
  EXPECT_EQ(memory.OfTenant("u"), 0);
}

TEST(TenantMemory, RefusesWhatHasNoRoomToThatTenantOnly) {
  TenantMemory memory(2);
  memory.Set(1, "t", kMebibyte);
  EXPECT_TRUE(memory.MakeRoom("t", kMebibyte).ok());
  const absl::Status refused = memory.MakeRoom("t", kMebibyte + 1);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.message(),
            "2 MiB beside the 1 MiB that the tenant's sessions in use hold are more memory than a "
            "tenant may have, 2 MiB (--max-tenant-memory-mb); end other streams, or try later");
  EXPECT_EQ(RefusalOf(refused)->limit, "--max-tenant-memory-mb");
  EXPECT_TRUE(RefusalOf(refused)->retry_delay);
  EXPECT_TRUE(memory.MakeRoom("u", 2 * kMebibyte).ok());
  EXPECT_TRUE(TenantMemory(0).MakeRoom("t", int64_t{1} << 60).ok());
}

class TenantMemoryTest : public testing::Test {
 protected:
  void SetUp() override { Open({.memory_mb_per_tenant = 1}); }
  void Open(const SessionLimits& limits) {
    auto opened = SessionRegistry::Open(
        {.executor = executor_, .journal = journal_, .models = models_, .limits = limits},
        [] { return google::protobuf::Timestamp(); });
    ASSERT_TRUE(opened.ok()) << opened.status();
    registry_ = *std::move(opened);
  }

  absl::StatusOr<std::shared_ptr<Session>> Create(const std::string& tenant, const std::string& id,
                                                  const v1::Problem& problem = SmallProblem()) {
    auto session = registry_->Create(tenant, id, problem);
    if (session.ok()) AwaitTasksOf(**session);
    return session;
  }

  // Waits until the tasks of all sessions are done, which one thread runs in their order.
  static void AwaitTasksOf(Session& session) {
    std::promise<void> done;
    ASSERT_TRUE(session.strand().Submit([&] { done.set_value(); }).ok());
    done.get_future().wait();
  }

  int64_t Held(const std::string& tenant) const {
    return registry_->services().tenant_memory->OfTenant(tenant);
  }

  MemoryJournal journal_;
  ModelLibrary models_;
  Executor executor_{
      {.threads_per_lane = 1, .threads = 1, .capacity = 100, .capacity_per_lane = 100}};
  std::unique_ptr<SessionRegistry> registry_;
};

TEST_F(TenantMemoryTest, UnloadsIdleSessionsOfTheTenantThatNeedsRoomAndNoOthers) {
  const auto other = *Create("u", "other");
  const int64_t one = Held("u");
  ASSERT_GT(one, 0);
  std::vector<std::shared_ptr<Session>> sessions;
  const int64_t too_many = 2 * kMebibyte / one;
  for (int64_t i = 0; i < too_many; ++i) {
    const auto session = Create("t", absl::StrCat("s", i));
    ASSERT_TRUE(session.ok()) << session.status();
    sessions.push_back(*session);
    EXPECT_LE(Held("t"), kMebibyte);
  }
  EXPECT_FALSE(sessions.front()->loaded());
  EXPECT_TRUE(sessions.back()->loaded());
  EXPECT_TRUE(other->loaded());
  // One that has left comes back when it is needed, and another one leaves for it.
  ASSERT_TRUE(sessions.front()->Load({}).ok());
  AwaitTasksOf(*sessions.front());
  EXPECT_TRUE(sessions.front()->loaded());
  EXPECT_LE(Held("t"), kMebibyte);
  for (const auto& session : sessions) {
    ASSERT_TRUE(registry_->Delete("t", session->name()).ok());
  }
  sessions.clear();
  EXPECT_EQ(Held("t"), 0);
}

TEST_F(TenantMemoryTest, RefusesNewWorkWhileAllSessionsAreInUse) {
  std::vector<std::shared_ptr<Session>> sessions;
  std::vector<std::shared_ptr<Writer>> writers;
  absl::Status refused;
  for (int i = 0; refused.ok(); ++i) {
    ASSERT_LT(i, 100);
    const auto session = Create("t", absl::StrCat("s", i));
    refused = session.status();
    if (!session.ok()) break;
    sessions.push_back(*session);
    writers.push_back(std::make_shared<Writer>());
    ASSERT_TRUE(sessions.back()->ClaimWriter(writers.back(), "rig").ok());
  }
  EXPECT_EQ(RefusalOf(refused)->limit, "--max-tenant-memory-mb");
  EXPECT_TRUE(RefusalOf(refused)->retry_delay);
  EXPECT_LE(Held("t"), kMebibyte);
  EXPECT_TRUE(Create("u", "other").ok());
  EXPECT_TRUE(sessions.front()->Add(1, Rows(1)).ok());  // those in use go on
  sessions.back()->ReleaseWriter(writers.back().get());
  EXPECT_TRUE(Create("t", "last").ok());
}

TEST_F(TenantMemoryTest, RefusesAProblemThatIsTooLargeBeforeItIsComputed) {
  const auto refused = Create("t", "large", ProblemOfOrder(60, 10));
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(RefusalOf(refused.status())->limit, "--max-tenant-memory-mb");
  EXPECT_FALSE(RefusalOf(refused.status())->retry_delay);
  v1::ImportSessionRequest request;
  request.set_session_id("large");
  request.mutable_record()->mutable_head()->set_problem(DeterministicBytes(ProblemOfOrder(60, 10)));
  SessionImport import(*registry_, "t");
  EXPECT_EQ(RefusalOf(import.Take(request))->limit, "--max-tenant-memory-mb");
  EXPECT_EQ(Held("t"), 0);
}

TEST_F(TenantMemoryTest, WeighsImportsThatAreUnderWay) {
  v1::ImportSessionRequest request;
  request.set_session_id("a");
  request.mutable_record()->mutable_head()->set_problem(DeterministicBytes(SmallProblem()));
  {
    SessionImport import(*registry_, "t");
    ASSERT_TRUE(import.Take(request).ok());
    EXPECT_GT(Held("t"), 0);
  }
  EXPECT_EQ(Held("t"), 0);
}

TEST_F(TenantMemoryTest, WeighsBatchesThatAreNotYetComputed) {
  const auto session = *Create("t", "a");
  const auto writer = std::make_shared<Writer>();
  ASSERT_TRUE(session->ClaimWriter(writer, "rig").ok());
  const int64_t before = Held("t");
  v1::Measurements batch = Rows(40'000);  // 16 bytes each
  ASSERT_TRUE(session->Add(1, batch).ok());
  EXPECT_GE(Held("t"), before + 640'000);
  for (double& time : *batch.mutable_time_s()) time += 10;
  const auto refused = session->Add(2, batch);
  EXPECT_EQ(RefusalOf(refused.status())->limit, "--max-tenant-memory-mb");
  ASSERT_TRUE(session->Process({}).ok());
  EXPECT_TRUE(session->Add(2, batch).ok());
}

TEST_F(TenantMemoryTest, WeighsRowsThatAreHeldBackToBePutInOrder) {
  constexpr double kWindow_s = 3600;
  const auto created = registry_->Create("t", "a", SmallProblem(), kWindow_s);
  ASSERT_TRUE(created.ok()) << created.status();
  Session& session = **created;
  const auto writer = std::make_shared<Writer>();
  ASSERT_TRUE(session.ClaimWriter(writer, "rig").ok());
  const int64_t before = Held("t");
  v1::Measurements batch = Rows(10'000);  // some 100 bytes each
  ASSERT_TRUE(session.Add(1, batch).ok());
  ASSERT_TRUE(session.Process({}).ok());
  EXPECT_GE(Held("t"), before + 1'000'000);
  for (double& time : *batch.mutable_time_s()) time += 10;
  EXPECT_EQ(RefusalOf(session.Add(2, batch).status())->limit, "--max-tenant-memory-mb");
}

TEST_F(TenantMemoryTest, WeighsWhatTheAllocatorGives) {
  if (POLYEST_ADDRESS_SANITIZER || POLYEST_THREAD_SANITIZER) {
    GTEST_SKIP() << "a sanitizer has an allocator of its own";
  }
  Open({});
  // The first session makes what all of them share.
  for (const int order : {1, 15, 25, 35}) {
    const auto used = [] {
      const struct mallinfo2 info = mallinfo2();
      return static_cast<double>(info.uordblks + info.hblkhd);
    };
    const double before = used();
    const std::string tenant = absl::StrCat("of-order-", order);
    const auto session = *Create(tenant, "a", ProblemOfOrder(order));
    ASSERT_TRUE(session->Add(1, Rows(20)).ok());
    ASSERT_TRUE(session->CurrentEstimate({}).ok());
    const double given = used() - before;
    const auto weighed = static_cast<double>(Held(tenant));
    if (order == 1) continue;
    EXPECT_LT(weighed, 3 * given) << order << ": " << given;
    EXPECT_GT(weighed, given / 3) << order << ": " << given;
  }
}

}  // namespace
}  // namespace polyest::internal
