#include "client/cpp/measurement_stream.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <atomic>
#include <numeric>

namespace polyest {
namespace {

using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A daemon with one session, which takes batches by the contract's rules and breaks on demand.
class FakeDaemon : public v1::EstimationService::Service {
 public:
  using Stream =
      grpc::ServerReaderWriter<v1::StreamMeasurementsResponse, v1::StreamMeasurementsRequest>;

  FakeDaemon() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~FakeDaemon() override { Stop(); }

  std::string address() const { return absl::StrCat("127.0.0.1:", port_); }
  void Stop() { server_->Shutdown(std::chrono::system_clock::now()); }

  grpc::Status GetSession(grpc::ServerContext*, const v1::GetSessionRequest* request,
                          v1::Session* session) override {
    if (lost) return {grpc::StatusCode::NOT_FOUND, "no such session"};
    session->set_name(request->name());
    session->set_last_sequence(last_sequence);
    return grpc::Status::OK;
  }

  grpc::Status StreamMeasurements(grpc::ServerContext*, Stream* stream) override {
    ++connections;
    if (refusal && connections == 1) return *refusal;
    v1::StreamMeasurementsRequest request;
    int taken = 0;
    while (stream->Read(&request)) {
      if (request.sequence() == 0) continue;  // only says how often estimates are wanted
      if (request.sequence() != last_sequence + 1) {
        return {grpc::StatusCode::INVALID_ARGUMENT, "not the next batch"};
      }
      last_sequence = request.sequence();
      times.push_back(request.measurements().time(0));
      ++taken;
      // The batch is taken, but its acknowledgement gets lost with the connection.
      if (connections <= breaks && taken == 3) {
        return {grpc::StatusCode::UNAVAILABLE, "the cable was pulled"};
      }
      if (taken % acknowledge_every == 0) Acknowledge(*stream);
    }
    Acknowledge(*stream);
    v1::StreamMeasurementsResponse last;
    last.mutable_estimate()->set_sequence(last_sequence);
    if (last_sequence > 0) stream->Write(last);
    return grpc::Status::OK;
  }

  int breaks = 0;  // so many connections break after three batches
  int acknowledge_every = 1;
  std::atomic<bool> lost = false;
  std::optional<grpc::Status> refusal;  // of the first stream
  std::atomic<int64_t> last_sequence = 0;
  std::atomic<int64_t> acknowledged = 0;
  std::atomic<int> connections = 0;
  std::vector<double> times;  // taken

 private:
  void Acknowledge(Stream& stream) {
    acknowledged = last_sequence.load();
    v1::StreamMeasurementsResponse response;
    response.mutable_acknowledgement()->set_sequence(acknowledged);
    stream.Write(response);
  }

  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

class MeasurementStreamTest : public ::testing::Test {
 protected:
  MeasurementStreamTest() : client_(daemon_.address()) {
    options_.first_delay = std::chrono::milliseconds(1);
    options_.longest_delay = std::chrono::milliseconds(20);
    callbacks_.connection = [this](const std::string& sentence) { told_.push_back(sentence); };
    callbacks_.estimate = [this](const v1::Estimate&) { ++estimates_; };
  }

  static v1::Measurements Batch(double time) {
    v1::Measurements batch;
    batch.add_time(time);
    return batch;
  }

  // Batches at 1, 2 … count.
  static absl::Status SendBatches(MeasurementStream& stream, int count) {
    for (int i = 1; i <= count; ++i) {
      if (absl::Status status = stream.Send(Batch(i)); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

  static std::vector<double> Times(int count) {
    std::vector<double> times(static_cast<size_t>(count));
    std::iota(times.begin(), times.end(), 1);
    return times;
  }

  FakeDaemon daemon_;
  Client client_;
  MeasurementStreamOptions options_;
  MeasurementStreamCallbacks callbacks_;
  std::vector<std::string> told_;
  int estimates_ = 0;
};

TEST_F(MeasurementStreamTest, DeliversEveryBatchAndTheLastEstimate) {
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  ASSERT_TRUE(SendBatches(stream, 50).ok());
  const auto last = stream.Finish();
  ASSERT_TRUE(last.ok()) << last.status();
  EXPECT_EQ((*last)->sequence(), 50);
  EXPECT_THAT(daemon_.times, ElementsAreArray(Times(50)));
  EXPECT_EQ(estimates_, 1);
  EXPECT_THAT(told_, IsEmpty());
}

TEST_F(MeasurementStreamTest, LosesAndRepeatsNothingWhenConnectionsBreak) {
  daemon_.breaks = 4;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  ASSERT_TRUE(SendBatches(stream, 40).ok());
  const auto last = stream.Finish();
  ASSERT_TRUE(last.ok()) << last.status();
  EXPECT_EQ((*last)->sequence(), 40);
  EXPECT_THAT(daemon_.times, ElementsAreArray(Times(40)));
  EXPECT_EQ(daemon_.connections, 5);
  ASSERT_FALSE(told_.empty());
  EXPECT_THAT(told_.front(), HasSubstr("connection lost (the cable was pulled)"));
  EXPECT_EQ(told_.back(), "connected again");
}

TEST_F(MeasurementStreamTest, NumbersOnFromTheSessionsLastBatch) {
  daemon_.last_sequence = 7;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  ASSERT_TRUE(SendBatches(stream, 2).ok());
  ASSERT_TRUE(stream.Finish().ok());
  EXPECT_EQ(daemon_.last_sequence, 9);
}

TEST_F(MeasurementStreamTest, BoundsWhatIsNotAcknowledged) {
  options_.most_unacknowledged = 3;
  daemon_.acknowledge_every = 3;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  for (int sent = 1; sent <= 30; ++sent) {
    ASSERT_TRUE(stream.Send(Batch(sent)).ok());
    ASSERT_LE(sent - daemon_.acknowledged, 3);
  }
  ASSERT_TRUE(stream.Finish().ok());
  EXPECT_EQ(daemon_.acknowledged, 30);
}

TEST_F(MeasurementStreamTest, SaysThatTheDaemonHasLostTheSession) {
  daemon_.breaks = 1;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  daemon_.lost = true;
  absl::Status status = SendBatches(stream, 10);
  if (status.ok()) status = stream.Finish().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), HasSubstr("the daemon has lost sessions/a"));
}

TEST_F(MeasurementStreamTest, FailsWithTheDaemonsReasonWhenABatchIsRefused) {
  daemon_.refusal = grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "measurements.time[0]: no");
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  absl::Status status = SendBatches(stream, 1);
  if (status.ok()) status = stream.Finish().status();
  EXPECT_EQ(status, absl::InvalidArgumentError("measurements.time[0]: no"));
  EXPECT_THAT(told_, IsEmpty());
}

TEST_F(MeasurementStreamTest, DoesNotFightAnotherWriter) {
  daemon_.refusal = grpc::Status(grpc::StatusCode::ABORTED, "the session has a writer");
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  EXPECT_EQ(stream.Finish().status(), absl::AbortedError("the session has a writer"));
  EXPECT_EQ(daemon_.connections, 1);
}

TEST_F(MeasurementStreamTest, GivesUpWhenTheDaemonStaysAway) {
  options_.most_attempts = 3;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  daemon_.Stop();
  absl::Status status = SendBatches(stream, 100);
  // A call that is cut off ends CANCELLED, one that finds nobody UNAVAILABLE.
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(told_.size(), 3);
}

TEST_F(MeasurementStreamTest, MayBeDroppedInMidstream) {
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  ASSERT_TRUE(stream.Send(Batch(1)).ok());
}

TEST_F(MeasurementStreamTest, CannotOpenASessionThatThereIsNot) {
  daemon_.lost = true;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  EXPECT_EQ(stream.Open().code(), absl::StatusCode::kNotFound);
}

TEST(Client, TellsThatADaemonIsUnreachable) {
  std::string address;
  {
    FakeDaemon gone;
    address = gone.address();
  }
  Client client(address);
  EXPECT_EQ(client.GetSession({}).status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace polyest
