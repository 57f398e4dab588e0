#include <thread>

#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

class StreamTest : public DaemonTest {
 protected:
  void SetUp() override {
    DaemonTest::SetUp();
    ASSERT_TRUE(Create("rig").ok());
  }
};

TEST_F(StreamTest, AcknowledgesEachBatchAndEndsWithTheEstimateOfTheWholeRecord) {
  ClientStream stream(*sessions_);
  v1::Estimate estimate;
  for (int batch = 0; batch < 6; ++batch) {
    // The first request alone names the session.
    ASSERT_TRUE(stream.Send(batch == 0 ? "sessions/rig" : "", batch + 1,
                            OscillatorRows(10 * batch, 10 * (batch + 1))));
    stream.ExpectAcknowledgement(batch + 1);
    stream.ExpectEstimate(estimate);
    EXPECT_EQ(estimate.sequence(), batch + 1);
    EXPECT_EQ(estimate.samples(), 10 * (batch + 1));
  }
  stream.HalfClose();
  v1::Estimate last;
  stream.ExpectEstimate(last);
  EXPECT_TRUE(stream.Finish().ok());
  EXPECT_EQ(WithoutSequence(last), WithoutSequence(EstimateAtOnce(60)));
}

TEST_F(StreamTest, CutOtherwiseGivesTheSameBits) {
  ClientStream stream(*sessions_);
  int row = 0, batch = 0;
  for (const int rows : {1, 2, 30, 7, 20}) {
    ASSERT_TRUE(
        stream.Send("sessions/rig", ++batch, OscillatorRows(row, row + rows),
                    [](auto& request) { request.mutable_estimates()->set_only_last(true); }));
    row += rows;
  }
  stream.HalfClose();
  for (int i = 1; i <= batch; ++i) stream.ExpectAcknowledgement(i);
  v1::Estimate last;
  stream.ExpectEstimate(last);
  EXPECT_TRUE(stream.Finish().ok());
  EXPECT_EQ(WithoutSequence(last), WithoutSequence(EstimateAtOnce(60)));
}

TEST_F(StreamTest, EstimatesAsOftenAsAsked) {
  ClientStream stream(*sessions_);
  v1::StreamMeasurementsRequest policy;
  policy.set_session("sessions/rig");
  policy.mutable_estimates()->set_batch_count(3);
  ASSERT_TRUE(stream.SendRequest(policy));
  for (int batch = 0; batch < 7; ++batch) {
    ASSERT_TRUE(stream.Send("", batch + 1, OscillatorRows(2 * batch, 2 * (batch + 1))));
  }
  stream.HalfClose();
  std::vector<int64_t> estimates;
  v1::StreamMeasurementsResponse response;
  while (stream.Read(response)) {
    if (response.has_estimate()) estimates.push_back(response.estimate().sequence());
  }
  EXPECT_TRUE(stream.Finish().ok());
  EXPECT_THAT(estimates, testing::ElementsAre(3, 6, 7));
}

TEST_F(StreamTest, TakesManyMoreBatchesThanItsQueuesHold) {
  constexpr int kBatches = 500;
  ClientStream stream(*sessions_);
  std::jthread writer([&] {
    for (int batch = 0; batch < kBatches; ++batch) {
      ASSERT_TRUE(
          stream.Send("sessions/rig", batch + 1, OscillatorRows(batch, batch + 1),
                      [](auto& request) { request.mutable_estimates()->set_only_last(true); }));
    }
    stream.HalfClose();
  });
  for (int i = 1; i <= kBatches; ++i) stream.ExpectAcknowledgement(i);
  v1::Estimate last;
  stream.ExpectEstimate(last);
  EXPECT_EQ(last.samples(), kBatches);
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(StreamTest, GoesOnWhereAnEarlierStreamEnded) {
  {
    ClientStream stream(*sessions_);
    ASSERT_TRUE(stream.Send("sessions/rig", 1, OscillatorRows(0, 30)));
    stream.HalfClose();
    v1::StreamMeasurementsResponse response;
    while (stream.Read(response)) {
    }
    ASSERT_TRUE(stream.Finish().ok());
  }
  ClientStream stream(*sessions_);
  // The client repeats the batch, as it does after a lost acknowledgement.
  ASSERT_TRUE(stream.Send("sessions/rig", 1, OscillatorRows(0, 30)));
  stream.ExpectAcknowledgement(1);
  v1::Estimate estimate;
  stream.ExpectEstimate(estimate);
  EXPECT_EQ(estimate.samples(), 30);
  ASSERT_TRUE(stream.Send("sessions/rig", 2, OscillatorRows(30, 60)));
  stream.ExpectAcknowledgement(2);
  stream.ExpectEstimate(estimate);
  EXPECT_EQ(WithoutSequence(estimate), WithoutSequence(EstimateAtOnce(60)));
}

TEST_F(StreamTest, EndsOnABadBatchWithItsFieldAndLeavesTheSessionUsable) {
  struct Case {
    int64_t sequence;
    v1::Measurements rows;
    std::string message;
    grpc::StatusCode code = grpc::StatusCode::INVALID_ARGUMENT;
  };
  v1::Measurements unnamed = OscillatorRows(5, 6);
  unnamed.mutable_channels(0)->set_name("q");
  v1::Measurements past = OscillatorRows(0, 1);
  v1::Measurements infinite = OscillatorRows(5, 6);
  infinite.mutable_channels(0)->set_values(0, INFINITY);
  ASSERT_TRUE(Add("sessions/rig", 1, OscillatorRows(0, 5)).ok());
  for (const Case& bad :
       {Case{3, OscillatorRows(5, 6), "sequence: 3 leaves a gap; the next batch must be 2",
             grpc::StatusCode::FAILED_PRECONDITION},
        Case{1, OscillatorRows(5, 6), "sequence: 1 was taken with other measurements",
             grpc::StatusCode::ALREADY_EXISTS},
        Case{2, unnamed, "\"q\""}, Case{2, past, "times must increase"},
        Case{2, infinite, "measurements.channels[0].values[0]: inf of x must be finite"}}) {
    ClientStream stream(*sessions_);
    ASSERT_TRUE(stream.Send("sessions/rig", bad.sequence, bad.rows));
    v1::StreamMeasurementsResponse response;
    EXPECT_FALSE(stream.Read(response));
    const grpc::Status status = stream.Finish();
    EXPECT_EQ(status.error_code(), bad.code);
    EXPECT_THAT(status.error_message(), testing::HasSubstr(bad.message));
  }
  EXPECT_TRUE(Add("sessions/rig", 2, OscillatorRows(5, 6)).ok());
}

TEST_F(StreamTest, RefusesAStreamWithoutItsSession) {
  struct Case {
    std::string session;
    grpc::StatusCode code;
  };
  for (const Case& bad : {Case{"", grpc::StatusCode::INVALID_ARGUMENT},
                          Case{"rig", grpc::StatusCode::INVALID_ARGUMENT},
                          Case{"sessions/none", grpc::StatusCode::NOT_FOUND}}) {
    ClientStream stream(*sessions_);
    stream.Send(bad.session, 1, OscillatorRows(0, 1));
    EXPECT_EQ(stream.Finish().error_code(), bad.code) << bad.session;
  }
  ClientStream silent(*sessions_);
  silent.HalfClose();
  EXPECT_EQ(silent.Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(StreamTest, RefusesAChangeOfSessionAndABatchWithoutMeasurements) {
  ASSERT_TRUE(Create("other").ok());
  ClientStream change(*sessions_);
  ASSERT_TRUE(change.Send("sessions/rig", 1, OscillatorRows(0, 1)));
  change.ExpectAcknowledgement(1);
  change.Send("sessions/other", 2, OscillatorRows(1, 2));
  v1::StreamMeasurementsResponse response;
  while (change.Read(response)) {
  }
  EXPECT_EQ(change.Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);

  ClientStream empty(*sessions_);
  v1::StreamMeasurementsRequest request;
  request.set_session("sessions/rig");
  request.set_sequence(2);
  empty.SendRequest(request);
  const grpc::Status status = empty.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "measurements: batch 2 has none");
}

TEST_F(StreamTest, IsTheOnlyWriterOfItsSession) {
  ClientStream first(*sessions_);
  ASSERT_TRUE(first.Send("sessions/rig", 1, OscillatorRows(0, 1)));
  first.ExpectAcknowledgement(1);
  ClientStream second(*sessions_);
  second.Send("sessions/rig", 2, OscillatorRows(1, 2));
  EXPECT_EQ(second.Finish().error_code(), grpc::StatusCode::ABORTED);
  first.HalfClose();
  v1::StreamMeasurementsResponse response;
  while (first.Read(response)) {
  }
  ASSERT_TRUE(first.Finish().ok());
  // The session is free at once for the next stream.
  ClientStream third(*sessions_);
  ASSERT_TRUE(third.Send("sessions/rig", 2, OscillatorRows(1, 2)));
  third.ExpectAcknowledgement(2);
}

TEST_F(StreamTest, FreesItsSessionWhenCancelled) {
  {
    ClientStream stream(*sessions_);
    ASSERT_TRUE(stream.Send("sessions/rig", 1, OscillatorRows(0, 1)));
    stream.ExpectAcknowledgement(1);
    stream.Cancel();
    EXPECT_EQ(stream.Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  // The daemon notices the end a moment later; until then it answers ABORTED.
  while (true) {
    ClientStream stream(*sessions_);
    stream.Send("sessions/rig", 2, OscillatorRows(1, 2));
    v1::StreamMeasurementsResponse response;
    if (stream.Read(response)) {
      EXPECT_EQ(response.acknowledgement().sequence(), 2);
      break;
    }
    ASSERT_EQ(stream.Finish().error_code(), grpc::StatusCode::ABORTED);
  }
}

TEST_F(StreamTest, EndsNotFoundWhenItsSessionIsDeleted) {
  ClientStream stream(*sessions_);
  ASSERT_TRUE(stream.Send("sessions/rig", 1, OscillatorRows(0, 1)));
  stream.ExpectAcknowledgement(1);
  v1::Estimate estimate;
  stream.ExpectEstimate(estimate);
  ASSERT_TRUE(Delete("sessions/rig").ok());
  v1::StreamMeasurementsResponse response;
  EXPECT_FALSE(stream.Read(response));
  EXPECT_EQ(stream.Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

}  // namespace
}  // namespace polyest::internal
