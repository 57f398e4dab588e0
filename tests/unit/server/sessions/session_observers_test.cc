// Tests what the observers of a session are told.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "tests/unit/server/sessions/session_fixture.h"

namespace polyest::internal {
namespace {

using SessionObserversTest = SessionTest;

TEST_F(SessionObserversTest, PassesThePresentEstimateAndEveryNewOneToObservers) {
  auto early = std::make_shared<CountingObserver>();
  auto late = std::make_shared<CountingObserver>();
  ASSERT_TRUE(session_->Observe(early, {}).ok());
  EXPECT_TRUE(early->estimates.empty());
  ASSERT_TRUE(Add(1, Batch({0.1})).ok());
  ASSERT_TRUE(session_->Observe(late, {}).ok());
  AwaitNews();
  ASSERT_EQ(early->estimates.size(), 1u);
  EXPECT_EQ(late->estimates, early->estimates);
  session_->Unobserve(early.get());
  ASSERT_TRUE(Add(2, Batch({0.2})).ok());
  ASSERT_TRUE(session_->CurrentEstimate({}).ok());
  AwaitNews();
  EXPECT_EQ(early->estimates.size(), 1u);
  ASSERT_EQ(late->estimates.size(), 2u);
  EXPECT_EQ(late->estimates[1]->sequence(), 2);
}

TEST_F(SessionObserversTest, TellsObserversOnAThreadThatIsNotTheJournals) {
  struct Watcher final : SessionObserver {
    void OnEstimate(const SharedEstimate&) override { told_by = std::this_thread::get_id(); }
    void OnClosed() override {}
    std::thread::id told_by;
  };
  const auto early = std::make_shared<Watcher>(), late = std::make_shared<Watcher>();
  journal_.Hold();
  ASSERT_TRUE(session_->Observe(early, {}).ok());
  ASSERT_TRUE(Add(1, Batch({0.1})).ok());
  ASSERT_TRUE(session_->CurrentEstimate({}).ok());
  ASSERT_TRUE(session_->Observe(late, {}).ok());
  journal_.Release();  // this thread acts as the journal's
  AwaitNews();
  for (const auto& watcher : {early, late}) {
    EXPECT_NE(watcher->told_by, std::thread::id());
    EXPECT_NE(watcher->told_by, std::this_thread::get_id());
  }
}

}  // namespace
}  // namespace polyest::internal
