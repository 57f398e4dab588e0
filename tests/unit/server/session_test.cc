#include "server/sessions/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/server/problem_json.h"

namespace polyest {
namespace {

// Undamped enough: x = v0/ω sin ωt at ω = 2π, near v0 = 1.
v1::Measurements Batch(std::initializer_list<double> times) {
  v1::Measurements batch;
  auto& x = *batch.add_channels();
  x.set_name("x");
  for (const double t : times) {
    batch.add_time(t);
    x.add_values(std::sin(2 * M_PI * t) * std::exp(-0.1 * t) / (2 * M_PI));
  }
  return batch;
}

struct Watcher : SessionObserver {
  void OnEstimate(const SharedEstimate& estimate) override { estimates.push_back(estimate); }
  void OnClosed() override { ++closed; }
  std::vector<SharedEstimate> estimates;
  int closed = 0;
};

class SessionTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = Session::Make("sessions/a", SmallProblem(), {}, executor_);
    ASSERT_TRUE(made.ok()) << made.status();
    session_ = *std::move(made);
  }

  // The test's own thread is the strand here: nothing else touches the session.
  Executor executor_{1, 10};
  std::shared_ptr<Session> session_;
};

TEST_F(SessionTest, AcknowledgesBatchesAndCountsTheirValues) {
  v1::Measurements batch = Batch({0.1, 0.2, 0.3});
  batch.mutable_channels(0)->add_missing(1);
  const auto first = session_->Add(1, batch);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->sequence(), 1);
  EXPECT_EQ(first->samples(), 2);
  const auto second = session_->Add(2, Batch({0.4}));
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->sequence(), 2);
  EXPECT_EQ(second->samples(), 3);
  EXPECT_EQ(session_->Describe().last_sequence(), 2);
  EXPECT_EQ(session_->Describe().samples(), 3);
}

TEST_F(SessionTest, CountsARepeatOnce) {
  ASSERT_TRUE(session_->Add(1, Batch({0.1})).ok());
  const auto repeat = session_->Add(1, Batch({0.1}));
  ASSERT_TRUE(repeat.ok()) << repeat.status();
  EXPECT_EQ(repeat->samples(), 1);
  EXPECT_EQ(session_->Add(1, Batch({0.2})).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(SessionTest, KeepsNothingOfABadBatchAndGoesOn) {
  v1::Measurements bad = Batch({0.1, 0.2});
  bad.set_time(1, 0.1);
  EXPECT_EQ(session_->Add(1, bad).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(session_->samples(), 0);
  EXPECT_TRUE(session_->Add(1, Batch({0.1})).ok());
}

TEST_F(SessionTest, EstimatesOnceForAllWhoAskUntilThereIsMore) {
  ASSERT_TRUE(session_->Add(1, Batch({0.1, 0.2})).ok());
  const auto first = session_->CurrentEstimate({});
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ((*first)->sequence(), 1);
  EXPECT_EQ((*first)->samples(), 2);
  EXPECT_EQ(*session_->CurrentEstimate({}), *first);
  ASSERT_TRUE(session_->Add(2, Batch({0.3})).ok());
  const auto second = session_->CurrentEstimate({});
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ((*second)->sequence(), 2);
}

TEST_F(SessionTest, PassesThePresentEstimateAndEveryNewOneToObservers) {
  auto early = std::make_shared<Watcher>();
  auto late = std::make_shared<Watcher>();
  ASSERT_TRUE(session_->Observe(early, {}).ok());
  EXPECT_TRUE(early->estimates.empty());
  ASSERT_TRUE(session_->Add(1, Batch({0.1})).ok());
  ASSERT_TRUE(session_->Observe(late, {}).ok());
  ASSERT_EQ(early->estimates.size(), 1u);
  EXPECT_EQ(late->estimates, early->estimates);
  session_->Unobserve(early.get());
  ASSERT_TRUE(session_->Add(2, Batch({0.2})).ok());
  ASSERT_TRUE(session_->CurrentEstimate({}).ok());
  EXPECT_EQ(early->estimates.size(), 1u);
  ASSERT_EQ(late->estimates.size(), 2u);
  EXPECT_EQ(late->estimates[1]->sequence(), 2);
}

TEST_F(SessionTest, HasOneWriterAtATime) {
  auto first = std::make_shared<Watcher>();
  auto second = std::make_shared<Watcher>();
  ASSERT_TRUE(session_->ClaimWriter(first).ok());
  EXPECT_EQ(session_->ClaimWriter(second).code(), absl::StatusCode::kAborted);
  session_->ReleaseWriter();
  EXPECT_TRUE(session_->ClaimWriter(second).ok());
}

TEST_F(SessionTest, TellsWriterAndObserversOfItsEndAndIsThenNotFound) {
  auto writer = std::make_shared<Watcher>();
  auto observer = std::make_shared<Watcher>();
  ASSERT_TRUE(session_->ClaimWriter(writer).ok());
  ASSERT_TRUE(session_->Observe(observer, {}).ok());
  session_->Close();
  EXPECT_EQ(writer->closed, 1);
  EXPECT_EQ(observer->closed, 1);
  EXPECT_EQ(session_->Add(1, Batch({0.1})).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(session_->CurrentEstimate({}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(session_->Observe(observer, {}).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(session_->ClaimWriter(writer).code(), absl::StatusCode::kNotFound);
}

TEST_F(SessionTest, GoesOnAfterAStopWithNothingLost) {
  ASSERT_TRUE(session_->Add(1, Batch({0.1, 0.2, 0.3})).ok());
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(session_->Process(Stop(source.get_token())).code(), absl::StatusCode::kCancelled);
  const auto estimate = session_->CurrentEstimate({});
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ((*estimate)->samples(), 3);
}

}  // namespace
}  // namespace polyest
