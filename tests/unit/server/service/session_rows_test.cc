#include "server/service/session_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/convert/problem.h"
#include "proto/wire/refusal/refusal.h"
#include "server/journal/memory_journal.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

class SessionRowsTest : public testing::Test {
 protected:
  SessionRowsTest() {
    SessionHead head;
    head.tenant = "t";
    head.name = "sessions/a";
    head.number = journal_.Create(head, SmallProblem(), /*hidden=*/false).value();
    session_ = std::make_shared<Session>(
        SessionServices{.executor = executor_,
                        .journal = journal_,
                        .models = models_,
                        .tenant_memory = std::make_shared<TenantMemory>(1)},
        head);
  }
  void Add(int64_t sequence, int first_row, int rows) {
    v1::Measurements batch;
    auto& x = *batch.add_channels();
    x.set_name("x");
    for (int row = first_row; row < first_row + rows; ++row) {
      batch.add_time_s(1e-4 * row);
      x.add_values(0.1);
    }
    ASSERT_TRUE(session_->Load({}).ok());
    const auto added = session_->Add(sequence, batch);
    ASSERT_TRUE(added.ok()) << added.status();
  }

  MemoryJournal journal_;
  ModelLibrary models_;
  Executor executor_{
      {.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10}};
  std::shared_ptr<Session> session_;
};

TEST_F(SessionRowsTest, AreNotReadBeyondTheMemoryOfTheTenant) {
  const ResolvedProblem problem = ToProblem(SmallProblem(), models_).value();
  Add(1, 1, 100);
  v1::Measurements rows;
  const auto read = ReadRows(*session_, problem, {}, {}, rows);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read, 1);
  EXPECT_EQ(rows.time_s_size(), 100);

  // Three times 32 B a row.
  Add(2, 101, 12'000);
  rows.Clear();
  const absl::Status refused = ReadRows(*session_, problem, {}, {}, rows).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(
      refused.message(),
      testing::HasSubstr("about 2 MiB of memory are needed, more than all loaded sessions of "
                         "a tenant may hold, 1 MiB (--max-tenant-memory-mb)"));
  EXPECT_EQ(RefusalOf(refused)->limit, "--max-tenant-memory-mb");
  EXPECT_EQ(rows.time_s_size(), 0);
}

TEST_F(SessionRowsTest, AreThoseThatTheEstimateHas) {
  const ResolvedProblem problem = ToProblem(SmallProblem(), models_).value();
  Add(1, 1, 60);
  Add(2, 61, 60);
  RunCuts cuts;
  cuts.Add({.run = 0, .time_s = 50e-4}, /*first_of_record=*/false, "the model failed");
  v1::Measurements rows;
  ASSERT_EQ(ReadRows(*session_, problem, cuts, {}, rows).value(), 2);
  EXPECT_EQ(rows.time_s_size(), 49);
  EXPECT_EQ(rows.channels(0).values_size(), 49);
}

}  // namespace
}  // namespace polyest::internal
