#include "server/web/shared_watch.h"

#include <gmock/gmock.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>

#include "polyest/v1/session_service.grpc.pb.h"
#include "server/security/method_roles.h"
#include "server/web/transcode.h"

namespace polyest::internal {
namespace {

using Event = WebCall::Event;

constexpr std::chrono::minutes kPatience{1};

v1::WatchSessionResponse EstimateOf(int64_t sequence) {
  v1::WatchSessionResponse response;
  response.mutable_estimate()->set_sequence(sequence);
  return response;
}

v1::WatchSessionResponse PredictionOf(int64_t sequence) {
  v1::WatchSessionResponse response;
  response.mutable_prediction()->set_sequence(sequence);
  return response;
}

// Sends to its watchers what the test says, one message at a time.
class Watched final : public v1::SessionService::Service {
 public:
  grpc::Status WatchSession(grpc::ServerContext* call, const v1::WatchSessionRequest*,
                            grpc::ServerWriter<v1::WatchSessionResponse>* writer) override {
    std::unique_lock lock(mutex_);
    ++calls_;
    changed_.notify_all();
    while (!ended_) {
      while (!messages_.empty()) {
        writer->Write(messages_.front());
        messages_.pop_front();
      }
      changed_.wait_for(lock, std::chrono::milliseconds(1));
      if (call->IsCancelled()) break;
    }
    ++ends_;
    changed_.notify_all();
    return {grpc::StatusCode::NOT_FOUND, "deleted"};
  }

  void Send(const v1::WatchSessionResponse& message) {
    const std::lock_guard lock(mutex_);
    messages_.push_back(message);
    changed_.notify_all();
  }
  void End() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }
  // Returns whether so many calls begin.
  bool AwaitCalls(int calls) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return calls_ == calls; });
  }
  // Returns whether so many calls end.
  bool AwaitEnds(int calls) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return ends_ == calls; });
  }
  int calls() const {
    const std::lock_guard lock(mutex_);
    return calls_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<v1::WatchSessionResponse> messages_;
  int calls_ = 0;
  int ends_ = 0;
  bool ended_ = false;
};

class SharedWatchTest : public ::testing::Test {
 protected:
  SharedWatchTest() {
    grpc::ServerBuilder builder;
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    watches_.emplace(server_->InProcessChannel({}));
  }

  std::shared_ptr<EventSource> Join(const std::string& who) {
    return watches_->Join({who}, {.method = PathOf("WatchSession")});
  }
  static Event Await(EventSource& client) {
    return client.Await(-1, WebCall::Clock::now() + kPatience);
  }
  // Returns the next message of a client, which must come.
  static std::string Next(EventSource& client) {
    EXPECT_EQ(Await(client), Event::kMessage);
    return *client.Take();
  }
  static std::string Text(const v1::WatchSessionResponse& message) {
    return "data: " + *ToJsonText(message.SerializeAsString(), *message.GetDescriptor()) + "\n\n";
  }

  Watched service_;
  std::unique_ptr<grpc::Server> server_;
  std::optional<SharedWatches> watches_;
};

TEST_F(SharedWatchTest, GivesEachMessageOfOneCallToAll) {
  const auto first = Join("reader"), second = Join("reader");
  for (int64_t sequence = 1; sequence <= 3; ++sequence) {
    service_.Send(EstimateOf(sequence));
    EXPECT_EQ(Next(*first), Text(EstimateOf(sequence)));
    EXPECT_EQ(Next(*second), Text(EstimateOf(sequence)));
  }
  EXPECT_EQ(service_.calls(), 1);
}

TEST_F(SharedWatchTest, EndsWithAMessageThatHasNoFormInJson) {
  const auto client = Join("reader");
  service_.Send(EstimateOf(1));
  EXPECT_EQ(Next(*client), Text(EstimateOf(1)));
  v1::WatchSessionResponse bad = EstimateOf(2);
  bad.mutable_estimate()->add_parameters()->set_name("\xff");
  service_.Send(bad);
  EXPECT_EQ(Await(*client), Event::kEnd);
  EXPECT_EQ(client->status().error_code(), grpc::StatusCode::INTERNAL);
}

TEST_F(SharedWatchTest, CallsForEachKeyAnew) {
  const auto first = Join("reader"), second = Join("writer");
  EXPECT_TRUE(service_.AwaitCalls(2));
}

TEST_F(SharedWatchTest, GivesWhoComesLateTheLastOfEachKindInTheirOrder) {
  const auto first = Join("reader");
  for (const auto& message : {PredictionOf(1), EstimateOf(1), PredictionOf(2), EstimateOf(2)}) {
    service_.Send(message);
    EXPECT_EQ(Next(*first), Text(message));
  }
  const auto late = Join("reader");
  EXPECT_EQ(Next(*late), Text(PredictionOf(2)));
  EXPECT_EQ(Next(*late), Text(EstimateOf(2)));
  EXPECT_EQ(late->Await(-1, WebCall::Clock::now()), Event::kTimeout);
  EXPECT_EQ(service_.calls(), 1);
}

TEST_F(SharedWatchTest, KeepsNoLargePredictionForWhoComesLate) {
  v1::WatchSessionResponse large = PredictionOf(1);
  large.mutable_prediction()->mutable_time_s()->Resize(100'000, 0.5);
  const auto first = Join("reader"), second = Join("reader");
  service_.Send(EstimateOf(1));
  Next(*first);
  Next(*second);
  service_.Send(large);
  EXPECT_EQ(Next(*first), Text(large));
  EXPECT_EQ(Next(*second), Text(large));
  const auto late = Join("reader");
  EXPECT_EQ(Next(*late), Text(EstimateOf(1)));
  EXPECT_EQ(late->Await(-1, WebCall::Clock::now()), Event::kTimeout);
}

TEST_F(SharedWatchTest, KeepsALargeEstimateForWhoComesLate) {
  v1::WatchSessionResponse large = EstimateOf(1);
  large.mutable_estimate()->mutable_covariance()->Resize(100'000, 0.5);
  const auto first = Join("reader");
  service_.Send(large);
  EXPECT_EQ(Next(*first), Text(large));
  const auto late = Join("reader");
  EXPECT_EQ(Next(*late), Text(large));
}

TEST_F(SharedWatchTest, LetsASlowClientMissAllButTheLast) {
  const auto slow = Join("reader"), fast = Join("reader");
  for (int64_t sequence = 1; sequence <= 3; ++sequence) {
    service_.Send(EstimateOf(sequence));
    Next(*fast);
  }
  // The last one may still be on its way.
  std::string event = Next(*slow);
  EXPECT_NE(event, Text(EstimateOf(1)));
  while (event != Text(EstimateOf(3))) event = Next(*slow);
}

TEST_F(SharedWatchTest, EndsForAllAndBeginsAnew) {
  const auto first = Join("reader"), second = Join("reader");
  service_.Send(EstimateOf(1));
  EXPECT_EQ(Next(*first), Text(EstimateOf(1)));
  service_.End();
  EXPECT_EQ(Await(*first), Event::kEnd);
  EXPECT_EQ(first->status().error_code(), grpc::StatusCode::NOT_FOUND);
  // What came before the end is not lost.
  EXPECT_EQ(Next(*second), Text(EstimateOf(1)));
  EXPECT_EQ(Await(*second), Event::kEnd);
  const auto third = Join("reader");
  EXPECT_TRUE(service_.AwaitCalls(2));
}

TEST_F(SharedWatchTest, IsCancelledWhenItsLastClientGoes) {
  auto first = Join("reader"), second = Join("reader");
  service_.Send(EstimateOf(1));
  Next(*first);
  first.reset();
  service_.Send(EstimateOf(2));
  while (Next(*second) != Text(EstimateOf(2))) continue;
  second.reset();
  EXPECT_TRUE(service_.AwaitEnds(1));
}

}  // namespace
}  // namespace polyest::internal
