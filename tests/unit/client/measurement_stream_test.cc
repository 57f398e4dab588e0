#include "polyest/measurement_stream.h"

#include <gmock/gmock.h>
#include <grpcpp/support/error_details.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numeric>

#include "polyest/rpc/error_details.pb.h"
#include "proto/wire/refusal/refusal.h"
#include "tests/testing/test_folder.h"
#include "tests/unit/client/fake_daemon.h"

namespace polyest::internal::measurement_stream_test {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class MeasurementStreamTest : public ::testing::Test {
 protected:
  MeasurementStreamTest() : client_(daemon_.address()) {
    options_.first_delay = std::chrono::milliseconds(1);
    options_.max_delay = std::chrono::milliseconds(20);
    callbacks_.connection = [this](const std::string& sentence) { told_.push_back(sentence); };
    callbacks_.estimate = [this](const v1::Estimate&) { ++estimates_; };
  }

  static v1::Measurements Batch(double time) {
    v1::Measurements batch;
    batch.add_time_s(time);
    return batch;
  }

  // Sends batches at 1, 2 … count.
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
  options_.max_unacknowledged = 3;
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

TEST_F(MeasurementStreamTest, ReturnsTheRefusedBatchAndThoseAfterIt) {
  daemon_.refused_time = 4;
  options_.max_unacknowledged = 3;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  EXPECT_TRUE(stream.Unacknowledged().empty());
  absl::Status status = SendBatches(stream, 10);
  if (status.ok()) status = stream.Finish().status();
  EXPECT_EQ(status, absl::InvalidArgumentError("not this one"));
  const std::vector<v1::Measurements> rest = stream.Unacknowledged();
  ASSERT_FALSE(rest.empty());
  EXPECT_EQ(rest.front().time_s(0), 4);
}

TEST_F(MeasurementStreamTest, DoesNotFightAnotherWriter) {
  daemon_.refusal = grpc::Status(grpc::StatusCode::ABORTED, "the session has a writer");
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  EXPECT_EQ(stream.Finish().status(), absl::AbortedError("the session has a writer"));
  EXPECT_EQ(daemon_.connections, 1);
}

TEST_F(MeasurementStreamTest, DoesNotFightAnotherWriterAfterABreak) {
  daemon_.breaks = 1;
  daemon_.refusals = 2;
  daemon_.on_break = [this] {
    daemon_.refusal = grpc::Status(grpc::StatusCode::ABORTED, "the session has a writer");
  };
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  absl::Status status = SendBatches(stream, 10);
  if (status.ok()) status = stream.Finish().status();
  EXPECT_EQ(status, absl::AbortedError("the session has a writer"));
  EXPECT_EQ(daemon_.connections, 2);
}

TEST_F(MeasurementStreamTest, DoesNotTakeBatchesOfAnotherClientForItsOwn) {
  daemon_.breaks = 1;
  // The third batch gets lost with the connection; another client's takes its number.
  daemon_.on_break = [this] { daemon_.times.back() = -1; };
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  absl::Status status = SendBatches(stream, 10);
  if (status.ok()) status = stream.Finish().status();
  EXPECT_EQ(status, absl::AbortedError("another client writes to sessions/a: taken with other "
                                       "measurements"));
  EXPECT_THAT(daemon_.times, ElementsAre(1, 2, -1));
}

TEST_F(MeasurementStreamTest, EndsAtOnceWhenAnotherClientHasGoneOn) {
  daemon_.breaks = 1;
  daemon_.on_break = [this] { daemon_.last_sequence = 100; };
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  absl::Status status = SendBatches(stream, 10);
  if (status.ok()) status = stream.Finish().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kAborted);
  EXPECT_THAT(status.message(), HasSubstr("another client writes to sessions/a"));
  EXPECT_EQ(daemon_.connections, 1);
}

TEST_F(MeasurementStreamTest, GivesUpWhenTheDaemonStaysAway) {
  options_.max_attempts = 3;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  daemon_.Stop();
  absl::Status status = SendBatches(stream, 100);
  // A call that is cut off ends with CANCELLED, one that finds no daemon with UNAVAILABLE.
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(told_.size(), 3);
}

// Makes RESOURCE_EXHAUSTED with an ErrorInfo, and with a RetryInfo if there is a delay.
grpc::Status Exhausted(const std::string& message, int delay_ms) {
  rpc::Status status;
  status.set_code(grpc::StatusCode::RESOURCE_EXHAUSTED);
  status.set_message(message);
  const auto add = [&](const google::protobuf::Message& detail) {
    auto& any = *status.add_details();
    any.set_type_url("type.googleapis.com/google.rpc." + detail.GetDescriptor()->name());
    detail.SerializeToString(any.mutable_value());
  };
  rpc::ErrorInfo info;
  info.set_reason(delay_ms > 0 ? kDiskFull : kLimitExceeded);
  (*info.mutable_metadata())["limit"] = "--max-something";
  add(info);
  rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_nanos(delay_ms * 1'000'000);
  if (delay_ms > 0) add(retry);
  grpc::Status result;
  EXPECT_TRUE(grpc::SetErrorDetails(status, &result).ok());
  return result;
}

TEST_F(MeasurementStreamTest, HoldsOutWhileTheDaemonHasNoRoomAndSaysSo) {
  daemon_.refusal = Exhausted("the disk is full", 2);
  daemon_.refusals = 40;  // more than the attempts to reach a daemon that is away
  std::vector<std::chrono::milliseconds> delays;
  options_.wait = [&](std::chrono::milliseconds delay) {
    delays.push_back(delay);
    return true;
  };
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  ASSERT_TRUE(SendBatches(stream, 10).ok());
  const auto last = stream.Finish();
  ASSERT_TRUE(last.ok()) << last.status();
  EXPECT_THAT(daemon_.times, ElementsAreArray(Times(10)));
  // The stream reports each delay once, and not again while the longest lasts.
  EXPECT_EQ(std::adjacent_find(told_.begin(), told_.end()), told_.end());
  ASSERT_LT(told_.size(), 41u);
  EXPECT_EQ(told_.front(),
            "the daemon cannot accept batches now (the disk is full); trying again in 0.002 s");
  EXPECT_EQ(told_.back(), "the daemon accepts batches again");
  // The delays begin at the one that the daemon asked for and grow up to the longest.
  EXPECT_EQ(delays.front(), std::chrono::milliseconds(2));
  EXPECT_EQ(delays.back(), options_.max_delay);
}

TEST_F(MeasurementStreamTest, DoesNotWaitForALimitThatWaitingDoesNotCure) {
  daemon_.refusal = Exhausted("too many rows", 0);
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  const absl::Status status = stream.Finish().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(status.message(), "too many rows");
  EXPECT_EQ(RefusalOf(status), (Refusal{kLimitExceeded, "--max-something", std::nullopt}));
  EXPECT_THAT(told_, IsEmpty());
}

TEST_F(MeasurementStreamTest, DoesNotWaitWhenItIsToldNotTo) {
  daemon_.refusal = Exhausted("the disk is full", 2);
  options_.wait = [](std::chrono::milliseconds) { return false; };
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  EXPECT_EQ(stream.Finish().status().message(), "the disk is full");
  EXPECT_EQ(daemon_.connections, 1);
}

class RotatedTokenTest : public MeasurementStreamTest {
 protected:
  // Streams with the token "one"; the daemon has exchanged it for "two" when the connection breaks.
  absl::Status Stream() {
    daemon_.authorization = "Bearer one";
    daemon_.breaks = 1;
    options_.max_unacknowledged = 1;
    Client client(daemon_.address(), {.token_file = file_});
    options_.wait = [this](std::chrono::milliseconds) {
      daemon_.authorization = "Bearer two";
      return true;
    };
    MeasurementStream stream(client, "sessions/a", options_, callbacks_);
    if (absl::Status opened = stream.Open(); !opened.ok()) return opened;
    if (absl::Status sent = SendBatches(stream, 2); !sent.ok()) return sent;
    exchange_();
    if (absl::Status sent = stream.Send(Batch(3)); !sent.ok()) return sent;
    return stream.Finish().status();
  }

  const TestFolder folder_;
  const std::string file_ = folder_.Write("token", "one");
  std::function<void()> exchange_;
};

TEST_F(RotatedTokenTest, IsTakenFromItsFileWithTheNextConnection) {
  exchange_ = [this] { folder_.Write("token", "two"); };
  const absl::Status status = Stream();
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_THAT(daemon_.times, ElementsAreArray(Times(3)));
}

TEST_F(RotatedTokenTest, IsMissedWithoutEndlessAttempts) {
  exchange_ = [] {};
  EXPECT_EQ(Stream().code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(RotatedTokenTest, LeavesTheLastOneWhileItsFileIsHalfWritten) {
  Client client(daemon_.address(), {.token_file = file_});
  EXPECT_EQ(client.Authorization(), "Bearer one");
  for (const char* bad : {"", "two words"}) {
    folder_.Write("token", bad);
    EXPECT_EQ(client.Authorization(), "Bearer one");
  }
  folder_.Write("token", "two");
  EXPECT_EQ(client.Authorization(), "Bearer two");
}

TEST_F(MeasurementStreamTest, MayBeDroppedInMidstream) {
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  ASSERT_TRUE(stream.Send(Batch(1)).ok());
}

TEST_F(MeasurementStreamTest, OpensOnceTheDaemonIsThere) {
  daemon_.absences = 2;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  ASSERT_TRUE(stream.Open().ok());
  ASSERT_TRUE(SendBatches(stream, 2).ok());
  ASSERT_TRUE(stream.Finish().ok());
  EXPECT_EQ(daemon_.last_sequence, 2);
  EXPECT_THAT(told_, ElementsAre("no connection (it is just starting); trying again in 0.001 s",
                                 "no connection (it is just starting); trying again in 0.002 s",
                                 "connected"));
}

TEST_F(MeasurementStreamTest, DoesNotOpenWhenTheDaemonStaysAway) {
  options_.max_attempts = 3;
  daemon_.absences = 100;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  EXPECT_EQ(stream.Open(), absl::UnavailableError("it is just starting"));
  EXPECT_EQ(told_.size(), 3);
}

TEST_F(MeasurementStreamTest, CannotOpenASessionThatThereIsNot) {
  daemon_.lost = true;
  MeasurementStream stream(client_, "sessions/a", options_, callbacks_);
  EXPECT_EQ(stream.Open().code(), absl::StatusCode::kNotFound);
}

TEST(StreamingClient, TellsThatADaemonIsUnreachable) {
  std::string address;
  {
    FakeDaemon gone;
    address = gone.address();
  }
  Client client(address);
  EXPECT_EQ(client.GetSession({}).status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace polyest::internal::measurement_stream_test
