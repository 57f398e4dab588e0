// Tests sessions of a journal that several daemons share.

#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <optional>
#include <thread>

#include "server/sessions/session.h"
#include "tests/testing/fake_shared_journal.h"
#include "tests/testing/faulty_journal.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

v1::Measurements Row(double time_s) {
  v1::Measurements batch;
  batch.add_time_s(time_s);
  auto& x = *batch.add_channels();
  x.set_name("x");
  x.add_values(0.1);
  return batch;
}

class Shared final : public FakeSharedJournal {
 public:
  absl::StatusOr<SessionPlace> Claim(int64_t) override {
    if (on_claim) on_claim();
    owns = true;
    return place;
  }
  void Release(int64_t) override {
    if (lacks_memory) throw std::bad_alloc();
  }
  bool Owns(int64_t) const override { return owns; }

  std::function<void()> on_claim;
  std::atomic<bool> owns = false;
  bool lacks_memory = false;
  SessionPlace place;
};

class SharedSessionTest : public testing::Test {
 protected:
  SharedSessionTest() {
    SessionHead head;
    head.name = "sessions/a";
    head.number = journal_.Create(head, SmallProblem(), /*hidden=*/true).value();
    journal_.Share(&shared_);
    session_ = std::make_shared<Session>(SessionServices{executor_, journal_, models_}, head);
  }

  Shared shared_;
  FaultyJournal journal_;
  Executor executor_{
      {.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10}};
  ModelLibrary models_;
  std::shared_ptr<Session> session_;
};

// The batch would follow a place that is not the session's any more.
TEST_F(SharedSessionTest, TakesNoBatchWhileItIsClaimed) {
  ASSERT_TRUE(session_->Load({}).ok());
  ASSERT_TRUE(session_->Add(1, Row(0.1)).ok());
  // Another daemon has had the session meanwhile, and has added batch 2.
  shared_.owns = false;
  journal_.Append({.session = session_->number(),
                   .measurements = Row(0.2).SerializeAsString(),
                   .digest = "",
                   .place = {.sequence = 2, .samples = 2, .rows = 2, .last_row = {0, 0.2}}},
                  [](const absl::Status& kept) { ASSERT_TRUE(kept.ok()) << kept; });
  shared_.place = {.sequence = 2, .samples = 2, .rows = 2, .last_row = {0, 0.2}};
  std::atomic<bool> adding = false;
  std::atomic<bool> added = false;
  std::jthread writer;
  shared_.on_claim = [&] {
    writer = std::jthread([&] {
      adding = true;
      session_->Add(2, Row(0.3)).IgnoreError();
      added = true;
    });
    while (!adding) std::this_thread::yield();
    // A writer that does not wait is done before long.
    for (int turn = 0; turn < 10'000 && !added; ++turn) std::this_thread::yield();
    EXPECT_FALSE(added);
  };
  const absl::Status loaded = session_->Load({});
  EXPECT_TRUE(loaded.ok()) << loaded;
  writer.join();
  EXPECT_EQ(session_->taken().sequence, 2);
  EXPECT_EQ(session_->place().last_row.time_s, 0.2);
}

TEST_F(SharedSessionTest, SurvivesALackOfMemoryWhenItIsUnloaded) {
  ASSERT_TRUE(session_->Load({}).ok());
  shared_.lacks_memory = true;
  EXPECT_NO_THROW(session_->Unload());
  shared_.lacks_memory = false;
  EXPECT_TRUE(session_->Load({}).ok());
}

}  // namespace
}  // namespace polyest::internal
