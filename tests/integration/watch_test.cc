#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

class Watch {
 public:
  Watch(v1::SessionService::Stub& stub, const std::string& session) {
    v1::WatchSessionRequest request;
    request.set_session(session);
    reader_ = stub.WatchSession(&context_, request);
  }
  // Returns the sequence of the next estimate, or −1 at the end.
  int64_t Next() {
    v1::WatchSessionResponse response;
    return reader_->Read(&response) ? response.estimate().sequence() : -1;
  }
  void Cancel() { context_.TryCancel(); }
  grpc::Status Finish() { return reader_->Finish(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::WatchSessionResponse>> reader_;
};

class WatchTest : public DaemonTest {
 protected:
  void SetUp() override {
    DaemonTest::SetUp();
    ASSERT_TRUE(Create("rig").ok());
    ASSERT_TRUE(Add("sessions/rig", 1, OscillatorRows(0, 5)).ok());
  }
};

TEST_F(WatchTest, ShowsPredictionsToThoseWhoAskForThem) {
  v1::WatchSessionRequest request;
  request.set_session("sessions/rig");
  request.mutable_prediction()->add_outputs("v");
  request.mutable_prediction()->set_max_row_count(3);
  grpc::ClientContext context;
  const auto reader = sessions_->WatchSession(&context, request);
  v1::WatchSessionResponse response;
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_TRUE(response.has_estimate());
  ASSERT_TRUE(reader->Read(&response));
  ASSERT_TRUE(response.has_prediction());
  EXPECT_FALSE(response.has_estimate());
  EXPECT_EQ(response.prediction().sequence(), 1);
  EXPECT_EQ(response.prediction().row_count(), 5);
  EXPECT_EQ(response.prediction().draw_count(), 50);
  ASSERT_EQ(response.prediction().outputs_size(), 1);
  EXPECT_EQ(response.prediction().outputs(0).output(), "v");
  EXPECT_EQ(response.prediction().outputs(0).mean_size(), 3);
  context.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);

  constexpr double kLastRow_s = 0.25;
  request.mutable_prediction()->set_forecast_s(0.3);
  grpc::ClientContext of_forecast;
  const auto ahead = sessions_->WatchSession(&of_forecast, request);
  while (!response.has_prediction() || response.prediction().time_s(0) <= kLastRow_s) {
    ASSERT_TRUE(ahead->Read(&response));
  }
  EXPECT_NEAR(response.prediction().time_s(2), kLastRow_s + 0.3, 1e-12);
  of_forecast.TryCancel();
  EXPECT_EQ(ahead->Finish().error_code(), grpc::StatusCode::CANCELLED);

  for (const int what : {0, 1, 2}) {
    v1::WatchSessionRequest bad = request;
    if (what == 0) bad.mutable_prediction()->set_outputs(0, "q");
    if (what == 1) bad.mutable_prediction()->set_min_interval_s(-1);
    if (what == 2) bad.mutable_prediction()->set_forecast_s(-1);
    grpc::ClientContext call;
    const auto refused = sessions_->WatchSession(&call, bad);
    while (refused->Read(&response)) EXPECT_FALSE(response.has_prediction());
    EXPECT_EQ(refused->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  }
}

TEST_F(WatchTest, ShowsThePresentEstimateAndNewOnesToEveryObserver) {
  Watch first(*sessions_, "sessions/rig"), second(*sessions_, "sessions/rig");
  EXPECT_EQ(first.Next(), 1);
  EXPECT_EQ(second.Next(), 1);
  ClientStream stream(*sessions_);
  ASSERT_TRUE(stream.Send("sessions/rig", 2, OscillatorRows(5, 10)));
  EXPECT_EQ(first.Next(), 2);
  EXPECT_EQ(second.Next(), 2);
  first.Cancel();
  EXPECT_EQ(first.Next(), -1);
  EXPECT_EQ(first.Finish().error_code(), grpc::StatusCode::CANCELLED);
  ASSERT_TRUE(stream.Send("sessions/rig", 3, OscillatorRows(10, 15)));
  EXPECT_EQ(second.Next(), 3);
}

TEST_F(WatchTest, ShowsEstimatesOfBatchesAddedByUnaryCalls) {
  Watch watch(*sessions_, "sessions/rig");
  EXPECT_EQ(watch.Next(), 1);
  ASSERT_TRUE(Add("sessions/rig", 2, OscillatorRows(5, 10)).ok());
  EXPECT_EQ(watch.Next(), 2);
}

TEST_F(WatchTest, MissesNeverTheLastEstimateWhenItIsSlow) {
  Watch watch(*sessions_, "sessions/rig");
  constexpr int64_t kLast = 40;
  for (int64_t sequence = 2; sequence <= kLast; ++sequence) {
    const int row = static_cast<int>(sequence) + 3;
    ASSERT_TRUE(Add("sessions/rig", sequence, OscillatorRows(row, row + 1)).ok());
  }
  int64_t previous = 0;
  while (previous != kLast) {
    const int64_t next = watch.Next();
    ASSERT_GT(next, previous);
    previous = next;
  }
}

TEST_F(WatchTest, EndsNotFoundWithItsSession) {
  Watch watch(*sessions_, "sessions/rig");
  EXPECT_EQ(watch.Next(), 1);
  ASSERT_TRUE(Delete("sessions/rig").ok());
  EXPECT_EQ(watch.Next(), -1);
  EXPECT_EQ(watch.Finish().error_code(), grpc::StatusCode::NOT_FOUND);
  Watch none(*sessions_, "sessions/rig");
  EXPECT_EQ(none.Next(), -1);
  EXPECT_EQ(none.Finish().error_code(), grpc::StatusCode::NOT_FOUND);
  Watch bad(*sessions_, "rig");
  EXPECT_EQ(bad.Next(), -1);
  EXPECT_EQ(bad.Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace polyest::internal
