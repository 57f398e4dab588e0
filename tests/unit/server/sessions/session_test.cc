#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "proto/wire/refusal/refusal.h"
#include "tests/unit/server/sessions/session_fixture.h"

namespace polyest::internal {
namespace {

TEST_F(SessionTest, AcknowledgesBatchesAndCountsTheirValues) {
  v1::Measurements batch = Batch({0.1, 0.2, 0.3});
  batch.mutable_channels(0)->add_missing(1);
  const auto first = Add(1, batch);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->sequence(), 1);
  EXPECT_EQ(first->sample_count(), 2);
  const auto second = Add(2, Batch({0.4}));
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->sequence(), 2);
  EXPECT_EQ(second->sample_count(), 3);
  EXPECT_EQ(session_->Describe().last_sequence(), 2);
  EXPECT_EQ(session_->Describe().sample_count(), 3);
}

TEST_F(SessionTest, CountsARepeatOnce) {
  ASSERT_TRUE(Add(1, Batch({0.1})).ok());
  const auto repeat = Add(1, Batch({0.1}));
  ASSERT_TRUE(repeat.ok()) << repeat.status();
  EXPECT_EQ(repeat->sample_count(), 1);
  EXPECT_EQ(Add(1, Batch({0.2})).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(Add(3, Batch({0.2})).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(SessionTest, KeepsNothingOfABadBatchAndGoesOn) {
  v1::Measurements bad = Batch({0.1, 0.2});
  bad.set_time_s(1, 0.1);
  EXPECT_EQ(Add(1, bad).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(session_->place().samples, 0);
  EXPECT_TRUE(Add(1, Batch({0.1})).ok());
}

TEST_F(SessionTest, EstimatesOnceForAllWhoAskUntilThereIsMore) {
  ASSERT_TRUE(Add(1, Batch({0.1, 0.2})).ok());
  const auto first = session_->CurrentEstimate({});
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ((*first)->sequence(), 1);
  EXPECT_EQ((*first)->samples(), 2);
  EXPECT_EQ(*session_->CurrentEstimate({}), *first);
  ASSERT_TRUE(Add(2, Batch({0.3})).ok());
  const auto second = session_->CurrentEstimate({});
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ((*second)->sequence(), 2);
}

TEST_F(SessionTest, KeepsTheHistoryOfItsEstimatesOverARestart) {
  ASSERT_TRUE(Add(1, Batch({0.1, 0.2})).ok());
  ASSERT_TRUE(session_->CurrentEstimate({}).ok());
  ASSERT_TRUE(Add(2, Batch({0.3})).ok());
  const auto second = session_->CurrentEstimate({});
  ASSERT_TRUE(second.ok()) << second.status();
  ASSERT_TRUE(session_->CurrentEstimate({}).ok());  // the same again
  const auto before = session_->History();
  ASSERT_TRUE(before.ok()) << before.status();
  ASSERT_EQ(before->points_size(), 2);
  const v1::EstimateHistory::Point& last = before->points(1);
  EXPECT_EQ(before->points(0).sequence(), 1);
  EXPECT_EQ(last.sequence(), 2);
  EXPECT_EQ(last.sample_count(), 3);
  EXPECT_EQ(last.time_s(), 0.3);
  ASSERT_EQ(last.parameters_size(), (*second)->parameters_size());
  EXPECT_EQ(last.parameters(0).mean(), (*second)->parameters(0).mean());
  EXPECT_EQ(last.parameters(0).lower95(), (*second)->parameters(0).lower95());

  Restart();
  const auto after = session_->History();
  ASSERT_TRUE(after.ok()) << after.status();
  EXPECT_EQ(after->SerializeAsString(), before->SerializeAsString());
  ASSERT_TRUE(session_->Load({}).ok());
  ASSERT_TRUE(session_->CurrentEstimate({}).ok());  // of the same batch: no new point
  EXPECT_EQ(session_->History()->points_size(), 2);
}

TEST_F(SessionTest, TakesBatchesLongBeforeItProcessesThem) {
  ASSERT_TRUE(Add(1, Batch({0.1, 0.2})).ok());
  ASSERT_TRUE(Add(2, Batch({0.3})).ok());
  ASSERT_TRUE(Add(3, Batch({0.4})).ok());
  EXPECT_EQ(session_->Describe().last_sequence(), 3);
  EXPECT_EQ(session_->Describe().activity().unprocessed_batch_count(), 3);
  ASSERT_TRUE(session_->ProcessUpTo(2, {}).ok());
  EXPECT_EQ(session_->Describe().activity().unprocessed_batch_count(), 1);
  const auto of_two = session_->LatestEstimate({});
  ASSERT_TRUE(of_two.ok()) << of_two.status();
  EXPECT_EQ((*of_two)->sequence(), 2);
  EXPECT_EQ((*of_two)->samples(), 3);
  const auto of_all = session_->CurrentEstimate({});
  ASSERT_TRUE(of_all.ok()) << of_all.status();
  EXPECT_EQ((*of_all)->sequence(), 3);
  EXPECT_EQ((*of_all)->samples(), 4);
  EXPECT_EQ(session_->Describe().activity().unprocessed_batch_count(), 0);
}

TEST_F(SessionTest, TakesBatchesWhileOthersAreComputedAndLosesNoneAndNoBit) {
  constexpr int kBatches = 200;
  limits_.rows = kBatches;
  Restart();
  ASSERT_TRUE(session_->Load({}).ok());
  {
    std::atomic<bool> refused = false;
    const std::jthread writer([&] {
      for (int batch = 1; batch <= kBatches && !refused; ++batch) {
        refused = !session_->Add(batch, Batch({0.01 * batch})).ok();
      }
    });
    while (session_->taken().sequence < kBatches) {
      ASSERT_FALSE(refused);
      ASSERT_TRUE(session_->Process({}).ok());
    }
  }
  const auto estimate = session_->CurrentEstimate({});
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ((*estimate)->sequence(), kBatches);
  Restart();
  const auto again = session_->CurrentEstimate({});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ((*estimate)->SerializeAsString(), (*again)->SerializeAsString());
}

TEST_F(SessionTest, TakesNothingWhileItIsNotInMemory) {
  EXPECT_EQ(session_->Add(1, Batch({0.1})).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(session_->taken().sequence, 0);
  ASSERT_TRUE(session_->Load({}).ok());
  EXPECT_TRUE(session_->Add(1, Batch({0.1})).ok());
}

TEST_F(SessionTest, HasOneWriterAtATime) {
  auto first = std::make_shared<CountingObserver>();
  auto second = std::make_shared<CountingObserver>();
  ASSERT_TRUE(session_->ClaimWriter(first, "").ok());
  EXPECT_EQ(session_->ClaimWriter(second, "").code(), absl::StatusCode::kAborted);
  session_->ReleaseWriter(second.get());
  EXPECT_EQ(session_->ClaimWriter(second, "").code(), absl::StatusCode::kAborted);
  session_->ReleaseWriter(first.get());
  EXPECT_TRUE(session_->ClaimWriter(second, "").ok());
}

TEST_F(SessionTest, LetsAWriterTakeOverFromItsOwnLostConnection) {
  auto first = std::make_shared<CountingObserver>();
  auto second = std::make_shared<CountingObserver>();
  auto other = std::make_shared<CountingObserver>();
  ASSERT_TRUE(session_->ClaimWriter(first, "rig").ok());
  EXPECT_EQ(session_->ClaimWriter(other, "other").code(), absl::StatusCode::kAborted);
  EXPECT_EQ(first->replaced, 0);
  ASSERT_TRUE(session_->ClaimWriter(second, "rig").ok());
  EXPECT_EQ(first->replaced, 1);
  session_->ReleaseWriter(first.get());
  EXPECT_TRUE(session_->Describe().activity().has_writer());
}

TEST_F(SessionTest, TellsWriterAndObserversOfItsEndAndIsThenNotFound) {
  auto writer = std::make_shared<CountingObserver>();
  auto observer = std::make_shared<CountingObserver>();
  ASSERT_TRUE(session_->ClaimWriter(writer, "").ok());
  ASSERT_TRUE(session_->Observe(observer, {}).ok());
  session_->Close();
  EXPECT_EQ(writer->closed, 1);
  EXPECT_EQ(observer->closed, 1);
  EXPECT_EQ(Add(1, Batch({0.1})).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(session_->CurrentEstimate({}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(session_->Observe(observer, {}).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(session_->ClaimWriter(writer, "").code(), absl::StatusCode::kNotFound);
}

TEST_F(SessionTest, GoesOnAfterAStopWithNothingLost) {
  ASSERT_TRUE(Add(1, Batch({0.1, 0.2, 0.3})).ok());
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(session_->Process(Stop(source.get_token())).code(), absl::StatusCode::kCancelled);
  const auto estimate = session_->CurrentEstimate({});
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ((*estimate)->samples(), 3);
}

TEST_F(SessionTest, GivesTheSameBitsAfterARestart) {
  ASSERT_TRUE(Add(1, Batch({0.1, 0.2})).ok());
  ASSERT_TRUE(Add(2, Batch({0.3})).ok());
  const std::string before = (*session_->CurrentEstimate({}))->SerializeAsString();
  Restart();
  EXPECT_FALSE(session_->loaded());
  EXPECT_EQ((*session_->CurrentEstimate({}))->SerializeAsString(), before);
  EXPECT_TRUE(session_->loaded());
  EXPECT_EQ(Add(2, Batch({0.3}))->sample_count(), 3);
  EXPECT_EQ(Add(1, Batch({0.3})).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_TRUE(Add(3, Batch({0.4})).ok());
}

TEST_F(SessionTest, IsUnloadedWhenIdleAndComesBackOnUse) {
  ASSERT_TRUE(Add(1, Batch({0.1, 0.2})).ok());
  const std::string before = (*session_->CurrentEstimate({}))->SerializeAsString();
  auto writer = std::make_shared<CountingObserver>();
  ASSERT_TRUE(session_->ClaimWriter(writer, "").ok());
  session_->Unload();
  EXPECT_TRUE(session_->loaded());
  EXPECT_TRUE(session_->ReadyToTake());
  session_->ReleaseWriter(writer.get());
  session_->Unload();
  EXPECT_FALSE(session_->loaded());
  EXPECT_FALSE(session_->ReadyToTake());
  EXPECT_EQ(session_->Describe().last_sequence(), 1);
  EXPECT_EQ((*session_->CurrentEstimate({}))->SerializeAsString(), before);
}

TEST_F(SessionTest, IsInUseWhileItIsComputed) {
  ASSERT_TRUE(Add(1, Batch({0.1})).ok());
  std::optional<Session::Clock::duration> idle;
  const auto look = [&](Estimator&, int64_t) {
    idle = session_->IdleTime();
    return absl::OkStatus();
  };
  ASSERT_TRUE(session_->WithEstimator(look, {}).ok());
  EXPECT_EQ(idle, std::nullopt);
  EXPECT_NE(session_->IdleTime(), std::nullopt);
}

TEST_F(SessionTest, StaysInMemoryIfItHasBeenUsedSinceItWasFoundIdle) {
  ASSERT_TRUE(session_->Load({}).ok());
  const auto found = session_->IdleTime();
  ASSERT_TRUE(found);
  ASSERT_TRUE(session_->Process({}).ok());
  session_->Unload(*found + std::chrono::hours(1));
  EXPECT_TRUE(session_->loaded());
  session_->Unload(*session_->IdleTime());
  EXPECT_FALSE(session_->loaded());
}

TEST_F(SessionTest, AcknowledgesABatchOnlyWhenItIsKept) {
  journal_.Hold();
  auto watcher = std::make_shared<CountingObserver>();
  ASSERT_TRUE(session_->Observe(watcher, {}).ok());
  ASSERT_TRUE(Add(1, Batch({0.1})).ok());
  ASSERT_TRUE(Add(2, Batch({0.2})).ok());
  ASSERT_TRUE(session_->CurrentEstimate({}).ok());
  const auto second = Kept(2), first = Kept(1);
  EXPECT_FALSE(first->has_value() || second->has_value());
  EXPECT_EQ(session_->Describe().last_sequence(), 0);
  AwaitNews();
  EXPECT_TRUE(watcher->estimates.empty());
  // The session is still in use, and a repeat is not answered early.
  session_->Unload();
  EXPECT_TRUE(session_->loaded());
  ASSERT_TRUE(Add(1, Batch({0.1})).ok());
  EXPECT_EQ(Add(1, Batch({0.2})).status().code(), absl::StatusCode::kAlreadyExists);
  journal_.Release();
  EXPECT_TRUE((*first)->ok() && (*second)->ok());
  EXPECT_EQ(session_->Describe().last_sequence(), 2);
  AwaitNews();
  EXPECT_EQ(watcher->estimates.size(), 1u);
}

TEST_F(SessionTest, ForgetsWhatAFullDiskCouldNotKeepAndGoesOnAfterIt) {
  ASSERT_TRUE(Add(1, Batch({0.1})).ok());
  const std::string before = (*session_->CurrentEstimate({}))->SerializeAsString();
  journal_.Hold();
  ASSERT_TRUE(Add(2, Batch({0.2})).ok());
  ASSERT_TRUE(Add(3, Batch({0.3})).ok());
  const auto second = Kept(2), third = Kept(3);
  journal_.Fail(absl::ResourceExhaustedError("full"));
  journal_.Release();
  EXPECT_EQ(second->value().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(third->value().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(Kept(3)->value().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_FALSE(session_->ReadyToTake());
  EXPECT_EQ(session_->Describe().last_sequence(), 1);
  EXPECT_EQ((*session_->CurrentEstimate({}))->SerializeAsString(), before);
  journal_.Fail(absl::OkStatus());
  ASSERT_TRUE(Add(2, Batch({0.25})).ok());
  EXPECT_EQ(Kept(2)->value().code(), absl::StatusCode::kResourceExhausted);
  losses_ = session_->losses();
  EXPECT_TRUE(Kept(2)->value().ok());
  EXPECT_EQ((*session_->CurrentEstimate({}))->samples(), 2);
}

TEST_F(SessionTest, RefusesWhatFollowsALostBatchWithTheLossAndItsDelayNotAsAGap) {
  const absl::Status full = Refuse(absl::StatusCode::kResourceExhausted, "full",
                                   {.reason = kDiskFull, .retry_delay = std::chrono::seconds(1)});
  ASSERT_TRUE(Add(1, Batch({0.1})).ok());
  const uint64_t losses = session_->losses();
  journal_.Hold();
  ASSERT_TRUE(session_->Add(2, Batch({0.2}), losses).ok());
  journal_.Fail(full);
  journal_.Release();
  // The stream has sent this batch before it could hear of the loss.
  EXPECT_EQ(session_->Add(3, Batch({0.3}), losses).status(), full);
  EXPECT_EQ(session_->Add(3, Batch({0.3})).status(), full);
  // The batch is refused even after the strand has loaded the session again.
  ASSERT_TRUE(session_->Load({}).ok());
  EXPECT_EQ(session_->Add(3, Batch({0.3}), losses).status(), full);
  EXPECT_EQ(session_->Add(2, Batch({0.2}), losses).status(), full);
  journal_.Fail(absl::OkStatus());
  EXPECT_TRUE(session_->Add(2, Batch({0.2}), session_->losses()).ok());
}

TEST_F(SessionTest, GoesOnFromASnapshotToTheSameBits) {
  limits_ = {};
  Restart();
  v1::Measurements rows;
  auto& x = *rows.add_channels();
  x.set_name("x");
  for (int row = 1; row <= 5'000; ++row) {
    const double t = 0.01 * row;
    rows.add_time_s(t);
    x.add_values(std::sin(2 * M_PI * t) * std::exp(-0.1 * t) / (2 * M_PI) +
                 0.01 * std::sin(12.9898 * row));
  }
  ASSERT_TRUE(Add(1, rows).ok());
  const std::string before = (*session_->CurrentEstimate({}))->SerializeAsString();
  const int64_t number = session_->number();
  auto snapshot = *journal_.ReadSnapshot(number);
  ASSERT_TRUE(snapshot.has_value());
  EXPECT_EQ(snapshot->sequence, 1);
  EXPECT_GT(snapshot->rows, 0);
  EXPECT_LT(snapshot->rows, 5'000);
  Restart();
  EXPECT_EQ((*session_->CurrentEstimate({}))->SerializeAsString(), before);
  // An unreadable snapshot is not needed.
  snapshot->state.resize(snapshot->state.size() / 2);
  journal_.SaveSnapshot(number, *snapshot);
  Restart();
  EXPECT_EQ((*session_->CurrentEstimate({}))->SerializeAsString(), before);
}

TEST_F(SessionTest, RefusesMoreRowsThanItMayHave) {
  EXPECT_EQ(Add(1, Batch({0.1, 0.2, 0.3, 0.4, 0.5})).status().message(),
            "measurements.timeS: 5 rows are more than a batch may have, 4 (--max-batch-rows)");
  ASSERT_TRUE(Add(1, Batch({0.1, 0.2, 0.3, 0.4})).ok());
  EXPECT_EQ(Add(2, Batch({0.5, 0.6, 0.7})).status().message(),
            "measurements.timeS: 3 rows beside the 4 of the session are more than it may have, 6 "
            "(--max-session-rows)");
  EXPECT_TRUE(Add(2, Batch({0.5, 0.6})).ok());
}

}  // namespace
}  // namespace polyest::internal
