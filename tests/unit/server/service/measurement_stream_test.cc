#include "server/service/measurement_stream.h"

#include <gtest/gtest.h>

#include <deque>
#include <future>
#include <latch>
#include <mutex>
#include <semaphore>
#include <thread>

#include "tests/testing/problem_json.h"
#include "tests/unit/server/service/service_fixture.h"

namespace polyest::internal {
namespace {

using Request = v1::StreamMeasurementsRequest;
using Response = v1::StreamMeasurementsResponse;

// Plays gRPC's side of a stream. Answers are read at once.
class Peer final : public grpc::ServerCallbackReaderWriter<Request, Response> {
 public:
  explicit Peer(MeasurementStream& stream) : stream_(stream) { BindReactor(&stream); }

  // Waits until the stream asks for a message, and gives it this one.
  void Give(const Request& request) {
    asked_.acquire();
    *request_ = request;
    stream_.OnReadDone(true);
  }
  // Returns whether the stream asks for a message now.
  bool Asks() {
    if (!asked_.try_acquire()) return false;
    asked_.release();
    return true;
  }
  // Waits for the next write. Returns whether it may wait for the one after it.
  bool NextWriteMayWait() {
    written_.acquire();
    const std::lock_guard lock(mutex_);
    const bool may_wait = buffered_.front();
    buffered_.pop_front();
    return may_wait;
  }
  grpc::StatusCode AwaitEnd() { return finished_.get_future().get(); }

  void SendInitialMetadata() override {}
  void Read(Request* request) override {
    request_ = request;
    asked_.release();
  }
  void Write(const Response*, grpc::WriteOptions options) override {
    {
      const std::lock_guard lock(mutex_);
      buffered_.push_back(options.get_buffer_hint());
    }
    written_.release();
    EXPECT_TRUE(writing_.Submit("", [this] { stream_.OnWriteDone(true); }).ok());
  }
  void WriteAndFinish(const Response*, grpc::WriteOptions, grpc::Status) override {}
  void Finish(grpc::Status status) override { finished_.set_value(status.error_code()); }

 private:
  grpc::internal::ServerReactor* reactor() override { return &stream_; }
  void CallOnDone() override {}

  MeasurementStream& stream_;
  Request* request_ = nullptr;
  std::counting_semaphore<> asked_{0};
  std::counting_semaphore<> written_{0};
  std::mutex mutex_;
  std::deque<bool> buffered_;  // whether each write that has not been awaited may wait
  std::promise<grpc::StatusCode> finished_;
  Executor writing_{{.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10}};
};

class MeasurementStreamTest : public ServiceTest {
 protected:
  MeasurementStreamTest() : ServiceTest(/*capacity=*/1) {}
  void SetUp() override {
    ServiceTest::SetUp();
    ASSERT_TRUE(sessions_->Create("default", "a", SmallProblem()).ok());
  }
  static Request Batch(int64_t sequence) {
    Request request;
    request.set_session("sessions/a");
    request.set_sequence(sequence);
    request.mutable_estimates()->set_only_last(true);
    request.mutable_measurements()->add_time_s(0.1 * static_cast<double>(sequence));
    auto& x = *request.mutable_measurements()->add_channels();
    x.set_name("x");
    x.add_values(0.1);
    return request;
  }

  grpc::CallbackServerContext call_;
};

TEST_F(MeasurementStreamTest, EndsWhereNoSessionIsNamedInTime) {
  ServiceContext context = Context();
  context.first_message = std::chrono::milliseconds(0);
  auto* const stream = new MeasurementStream(context, call_);
  Peer peer(*stream);
  EXPECT_EQ(peer.AwaitEnd(), grpc::StatusCode::DEADLINE_EXCEEDED);
  stream->OnDone();
  EXPECT_EQ(calls_.Count(OpenCalls::Kind::kWriter), 0);
}

TEST_F(MeasurementStreamTest, ReadsNoMoreWhileTooManyBytesWaitToBeComputed) {
  ServiceContext context = Context();
  context.held_bytes = static_cast<int64_t>(Batch(1).ByteSizeLong()) + 1;
  auto* const stream = new MeasurementStream(context, call_);
  Peer peer(*stream);
  Request hello;
  hello.set_session("sessions/a");
  peer.Give(hello);
  const auto session = sessions_->All().front();
  std::latch go_on(1);
  ASSERT_TRUE(session->strand().Submit([&] { go_on.wait(); }).ok());
  peer.Give(Batch(1));
  peer.Give(Batch(2));
  while (session->taken().sequence < 2) std::this_thread::yield();
  EXPECT_FALSE(peer.Asks());
  go_on.count_down();  // the queue of the executor was full, and the stream goes on all the same
  peer.Give(Batch(3));
  stream->OnCancel();
  EXPECT_EQ(peer.AwaitEnd(), grpc::StatusCode::CANCELLED);
  stream->OnDone();
}

TEST_F(MeasurementStreamTest, ReadsOneMessageAtATimeWhileTheTenantsStreamsHoldTooMuch) {
  ServiceContext context = Context();
  const std::string tenant = access_->Authorize(call_, "GetStatus")->tenant;
  StreamMemory::Share others(calls_.memory(), tenant);
  others.Add(StreamMemory::Limits().tenant);
  auto* const stream = new MeasurementStream(context, call_);
  Peer peer(*stream);
  Request hello;
  hello.set_session("sessions/a");
  peer.Give(hello);
  const auto session = sessions_->All().front();
  std::latch go_on(1);
  ASSERT_TRUE(session->strand().Submit([&] { go_on.wait(); }).ok());
  peer.Give(Batch(1));
  while (session->taken().sequence < 1) std::this_thread::yield();
  EXPECT_FALSE(peer.Asks());
  go_on.count_down();
  peer.Give(Batch(2));  // once the first is computed
  stream->OnCancel();
  EXPECT_EQ(peer.AwaitEnd(), grpc::StatusCode::CANCELLED);
  stream->OnDone();
}

TEST_F(MeasurementStreamTest, TakesBatchesOfASessionInMemoryWhileOthersCompute) {
  std::latch go_on(1);
  ASSERT_TRUE(executor_.Submit("others", [&] { go_on.wait(); }).ok());
  ServiceContext context = Context();
  auto* const stream = new MeasurementStream(context, call_);
  Peer peer(*stream);
  peer.Give(Batch(1));
  const auto session = sessions_->All().front();
  while (session->place().sequence < 1) std::this_thread::yield();
  go_on.count_down();
  stream->OnCancel();
  EXPECT_EQ(peer.AwaitEnd(), grpc::StatusCode::CANCELLED);
  stream->OnDone();
}

// gRPC keeps back a first response that may wait for another one, with the call's metadata, until
// the connection has something else to send.
TEST_F(MeasurementStreamTest, LetsAResponseWaitForTheNextButNotItsFirst) {
  ServiceContext context = Context();
  auto* const stream = new MeasurementStream(context, call_);
  Peer peer(*stream);
  const auto session = sessions_->All().front();
  for (const int64_t sequence : {1, 2}) {
    // The estimate is there before the acknowledgement may be sent.
    journal_.Hold();
    Request request = Batch(sequence);
    request.mutable_estimates()->set_only_last(false);
    request.mutable_estimates()->set_batch_count(1);
    peer.Give(request);
    while (session->Describe().activity().estimate_count() < sequence) std::this_thread::yield();
    std::promise<void> computed;
    ASSERT_TRUE(session->strand().Submit([&] { computed.set_value(); }, Admission::kAlways).ok());
    computed.get_future().wait();
    journal_.Release();
    EXPECT_EQ(peer.NextWriteMayWait(), sequence > 1);
    EXPECT_FALSE(peer.NextWriteMayWait());
  }
  stream->OnCancel();
  EXPECT_EQ(peer.AwaitEnd(), grpc::StatusCode::CANCELLED);
  stream->OnDone();
}

}  // namespace
}  // namespace polyest::internal
