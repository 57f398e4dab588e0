#include "server/service/operation_store.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

class OperationStoreTest : public testing::Test {
 protected:
  // Starts a job, which waits in `queue_` until it is run.
  absl::StatusOr<v1::Operation> Start(const std::string& tenant = "a",
                                      const absl::Status& outcome = absl::OkStatus()) {
    return store_.Start(tenant, "ComputeEstimate", [&](v1::ComputationResult* result) {
      return Job{[this](Task task) {
                   if (full_) return absl::ResourceExhaustedError("the queue is full");
                   queue_.push_back(std::move(task));
                   return absl::OkStatus();
                 },
                 [this, result, outcome](const Stop& stop, std::stop_source&,
                                         const UnaryCall::Finisher& finish) {
                   ++ran_;
                   result->mutable_estimate()->mutable_estimate()->set_samples(7);
                   if (rows_ > 0) result->mutable_prediction()->mutable_time_s()->Resize(rows_, 0);
                   const absl::Status stopped = stop.Check();
                   finish(stopped.ok() ? outcome : stopped);
                   return absl::OkStatus();
                 }};
    });
  }

  // Runs all jobs, because the store waits for them at its end.
  void TearDown() override { RunAll(); }
  void RunAll() {
    for (Task& task : queue_) task();
    queue_.clear();
  }

  v1::Operation::State StateOf(const std::string& name) { return store_.Get("a", name)->state(); }

  std::vector<Task> queue_;
  bool full_ = false;
  int ran_ = 0;
  int rows_ = 0;  // of the results
  OperationStore::Clock::time_point now_{};
  OperationStore store_{{.per_tenant = 2,
                         .max_computing = std::chrono::seconds(60),
                         .result_bytes_per_tenant = 12'000},
                        [] { return google::protobuf::Timestamp(); },
                        [this] { return now_; }};
};

TEST_F(OperationStoreTest, KeepsAResultUntilItIsFetched) {
  const auto started = Start();
  ASSERT_TRUE(started.ok()) << started.status();
  EXPECT_EQ(started->state(), v1::Operation::QUEUED);
  EXPECT_EQ(StateOf(started->name()), v1::Operation::QUEUED);
  RunAll();
  const auto done = store_.Get("a", started->name());
  EXPECT_EQ(done->state(), v1::Operation::SUCCEEDED);
  EXPECT_EQ(done->response().estimate().estimate().samples(), 7);
}

TEST_F(OperationStoreTest, HidesOperationsFromOtherTenants) {
  const auto started = Start();
  EXPECT_TRUE(absl::IsNotFound(store_.Get("b", started->name()).status()));
  EXPECT_TRUE(absl::IsNotFound(store_.Cancel("b", started->name()).status()));
  EXPECT_TRUE(absl::IsNotFound(store_.Delete("b", started->name())));
  EXPECT_TRUE(store_.List("b", 0, 10).operations.empty());
  RunAll();
  EXPECT_EQ(StateOf(started->name()), v1::Operation::SUCCEEDED);
}

TEST_F(OperationStoreTest, ListsTheNextPageAlsoWhenTheLastOfOneIsDeleted) {
  const std::string first = Start()->name();
  const std::string second = Start()->name();
  const OperationStore::Page page = store_.List("a", 0, 1);
  ASSERT_EQ(page.operations.size(), 1u);
  EXPECT_EQ(page.operations[0].name(), first);
  EXPECT_TRUE(page.more);
  ASSERT_TRUE(store_.Delete("a", first).ok());
  const OperationStore::Page next = store_.List("a", page.last, 1);
  ASSERT_EQ(next.operations.size(), 1u);
  EXPECT_EQ(next.operations[0].name(), second);
  EXPECT_FALSE(next.more);
  RunAll();
}

TEST_F(OperationStoreTest, CancelsWhatWaitsAtOnce) {
  const std::string name = Start()->name();
  EXPECT_EQ(store_.Cancel("a", name)->state(), v1::Operation::CANCELLED);
  now_ += std::chrono::seconds(5);
  RunAll();
  const auto cancelled = store_.Get("a", name);
  EXPECT_EQ(cancelled->state(), v1::Operation::CANCELLED);
  EXPECT_EQ(cancelled->error().code(), static_cast<int>(absl::StatusCode::kCancelled));
  EXPECT_EQ(cancelled->elapsed_time_s(), 0);
  EXPECT_FALSE(cancelled->has_response());
  EXPECT_EQ(ran_, 0);
}

TEST_F(OperationStoreTest, CountsWhatIsCancelledOrDeletedUntilItLeavesTheQueue) {
  ASSERT_TRUE(store_.Cancel("a", Start()->name()).ok());
  ASSERT_TRUE(store_.Delete("a", Start()->name()).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(Start().status()));
  EXPECT_TRUE(Start("b").ok());
  RunAll();
  EXPECT_EQ(ran_, 1);  // the other tenant's
  EXPECT_TRUE(Start().ok());
  EXPECT_TRUE(Start().ok());
}

TEST_F(OperationStoreTest, GivesAPlaceBackWithTheEndThoughItsTaskIsStillThere) {
  const auto first = Start(), second = Start();
  for (Task& task : queue_) task();
  EXPECT_EQ(StateOf(first->name()), v1::Operation::SUCCEEDED);
  const auto third = Start();
  EXPECT_TRUE(third.ok()) << third.status();
  queue_.erase(queue_.begin(), queue_.begin() + 2);
  EXPECT_TRUE(Start().ok());
  EXPECT_TRUE(absl::IsResourceExhausted(Start().status()));
}

TEST_F(OperationStoreTest, LeavesWhatIsDoneAsItIs) {
  const auto failed = Start("a", absl::InvalidArgumentError("uncertain: none"));
  RunAll();
  ASSERT_TRUE(store_.Cancel("a", failed->name()).ok());
  const auto found = store_.Get("a", failed->name());
  EXPECT_EQ(found->state(), v1::Operation::FAILED);
  EXPECT_EQ(found->error().message(), "uncertain: none");
  EXPECT_FALSE(found->has_response());
}

TEST_F(OperationStoreTest, MakesRoomByForgettingWhatEndedFirst) {
  const auto first = Start(), second = Start();
  RunAll();
  const auto third = Start();
  ASSERT_TRUE(third.ok()) << third.status();
  EXPECT_TRUE(absl::IsNotFound(store_.Get("a", first->name()).status()));
  EXPECT_TRUE(store_.Get("a", second->name()).ok());
  ASSERT_TRUE(Start().ok());
  // Both operations are under way now; another tenant has room of its own.
  EXPECT_TRUE(absl::IsResourceExhausted(Start().status()));
  EXPECT_TRUE(Start("b").ok());
  RunAll();
}

TEST_F(OperationStoreTest, ForgetsTheOldestResultsBeyondTheTenantsMemory) {
  rows_ = 1'000;  // 8000 bytes
  const std::string first = Start()->name(), other = Start("b")->name();
  RunAll();
  EXPECT_TRUE(store_.Get("a", first).ok());
  const std::string second = Start()->name();
  now_ += std::chrono::seconds(1);
  RunAll();
  EXPECT_TRUE(absl::IsNotFound(store_.Get("a", first).status()));
  EXPECT_TRUE(store_.Get("a", second).ok());
  EXPECT_TRUE(store_.Get("b", other).ok());
  rows_ = 10'000;  // more than all may have
  const std::string large = Start()->name();
  now_ += std::chrono::seconds(1);
  RunAll();
  EXPECT_TRUE(absl::IsNotFound(store_.Get("a", second).status()));
  EXPECT_EQ(store_.Get("a", large)->response().prediction().time_s_size(), rows_);
}

TEST_F(OperationStoreTest, ForgetsAnHourAfterTheEnd) {
  const auto started = Start();
  now_ += std::chrono::hours(2);
  EXPECT_TRUE(store_.Get("a", started->name()).ok());
  RunAll();
  now_ += std::chrono::minutes(59);
  EXPECT_TRUE(store_.Get("a", started->name()).ok());
  now_ += std::chrono::minutes(2);
  EXPECT_TRUE(absl::IsNotFound(store_.Get("a", started->name()).status()));
}

TEST_F(OperationStoreTest, KeepsNothingOfWhatFindsNoRoom) {
  full_ = true;
  EXPECT_TRUE(absl::IsResourceExhausted(Start().status()));
  EXPECT_TRUE(store_.List("a", 0, 10).operations.empty());
}

}  // namespace
}  // namespace polyest::internal
