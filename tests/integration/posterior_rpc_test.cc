// Tests the studies of a session and of complete measurements.

#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

class PosteriorRpcTest : public DaemonTest {
 protected:
  template <typename Request>
  static Request OneShot(int rows) {
    Request request;
    *request.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
    *request.mutable_subject()->mutable_experiment()->mutable_measurements() =
        OscillatorRows(0, rows);
    return request;
  }

  grpc::Status Get(const v1::ComputePosteriorRequest& request,
                   v1::ComputePosteriorResponse* response) {
    grpc::ClientContext context;
    return studies_->ComputePosterior(&context, request, response);
  }

  grpc::Status Profile(const v1::ComputeCostProfilesRequest& request,
                       v1::ComputeCostProfilesResponse* response) {
    grpc::ClientContext context;
    return studies_->ComputeCostProfiles(&context, request, response);
  }

  grpc::Status Sweep(const v1::ComputeRegularizationSweepRequest& request,
                     v1::ComputeRegularizationSweepResponse* response) {
    grpc::ClientContext context;
    return studies_->ComputeRegularizationSweep(&context, request, response);
  }

  // Makes a session with rows [0, 60).
  void FeedSession() {
    ASSERT_TRUE(Create("rig").ok());
    ASSERT_TRUE(Add("sessions/rig", 1, OscillatorRows(0, 60)).ok());
  }
};

TEST_F(PosteriorRpcTest, IsTheSameOfASessionAndFromTheMeasurementsAtOnce) {
  FeedSession();
  auto one_shot = OneShot<v1::ComputePosteriorRequest>(60);
  v1::ComputePosteriorRequest of_session;
  of_session.mutable_subject()->set_session("sessions/rig");
  for (v1::ComputePosteriorRequest* request : {&one_shot, &of_session}) {
    request->set_sample_count(10);
    auto& pair = *request->add_joints();
    pair.set_first("k");
    pair.set_second("c");
  }
  v1::ComputePosteriorResponse whole, session;
  ASSERT_TRUE(Get(one_shot, &whole).ok());
  ASSERT_TRUE(Get(of_session, &session).ok());
  EXPECT_EQ(session.sequence(), 1);
  session.clear_sequence();
  EXPECT_EQ(whole.SerializeAsString(), session.SerializeAsString());
  ASSERT_EQ(whole.parameters_size(), 2);
  EXPECT_EQ(whole.parameters(0).quantiles_size(), 3);
  EXPECT_EQ(whole.parameters(0).density_size(), 100);
  EXPECT_EQ(whole.samples_size(), 20);
  ASSERT_EQ(whole.joints_size(), 1);
  EXPECT_EQ(whole.joints(0).density_size(), 40 * 40);
  EXPECT_EQ(whole.measured_value_count(), 60);
  // The truth lies within 4 standard deviations.
  EXPECT_NEAR(whole.parameters(0).mean(), 40.66, 4 * whole.parameters(0).std_dev());
}

TEST_F(PosteriorRpcTest, ProfilesAreTheSameOfASessionAndFromTheMeasurementsAtOnce) {
  FeedSession();
  auto one_shot = OneShot<v1::ComputeCostProfilesRequest>(60);
  v1::ComputeCostProfilesRequest of_session;
  of_session.mutable_subject()->set_session("sessions/rig");
  v1::ComputeCostProfilesResponse whole, session;
  ASSERT_TRUE(Profile(one_shot, &whole).ok());
  ASSERT_TRUE(Profile(of_session, &session).ok());
  EXPECT_EQ(session.sequence(), 1);
  session.clear_sequence();
  EXPECT_EQ(whole.SerializeAsString(), session.SerializeAsString());
  ASSERT_EQ(whole.profiles_size(), 2);
  EXPECT_GT(whole.profiles(0).value_size(), 20);
  for (const double total : whole.profiles(0).total()) {
    EXPECT_GE(total, whole.least().total() * (1 - 1e-12));
  }
}

TEST_F(PosteriorRpcTest, SweepsAreTheSameOfASessionAndFromTheMeasurementsAtOnce) {
  FeedSession();
  auto one_shot = OneShot<v1::ComputeRegularizationSweepRequest>(60);
  v1::ComputeRegularizationSweepRequest of_session;
  of_session.mutable_subject()->set_session("sessions/rig");
  v1::ComputeRegularizationSweepResponse whole, session;
  ASSERT_TRUE(Sweep(one_shot, &whole).ok());
  ASSERT_TRUE(Sweep(of_session, &session).ok());
  EXPECT_EQ(session.sequence(), 1);
  session.clear_sequence();
  EXPECT_EQ(whole.SerializeAsString(), session.SerializeAsString());
  EXPECT_EQ(whole.parameters_size(), 2);
  EXPECT_EQ(whole.regularization(), 1);
  ASSERT_GT(whole.points_size(), 10);
  for (int k = 1; k < whole.points_size(); ++k) {
    EXPECT_GT(whole.points(k).regularization(), whole.points(k - 1).regularization());
    // More weight neither fits the data better nor moves farther from the prior.
    EXPECT_GE(whole.points(k).cost().mismatch(), whole.points(k - 1).cost().mismatch() - 1e-6);
    EXPECT_LE(whole.points(k).cost().prior(), whole.points(k - 1).cost().prior() + 1e-6);
    EXPECT_EQ(whole.points(k).map_size(), 2);
    EXPECT_EQ(whole.points(k).std_dev_size(), 2);
  }
}

TEST_F(PosteriorRpcTest, RefusesBadRequestsByTheirFields) {
  v1::ComputePosteriorResponse response;
  auto request = OneShot<v1::ComputePosteriorRequest>(20);
  request.set_sample_count(-1);
  grpc::Status status = Get(request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "sampleCount: -1 must be from 0 to 100000");
  v1::ComputePosteriorRequest missing;
  missing.mutable_subject()->set_session("sessions/rig");
  EXPECT_EQ(Get(missing, &response).error_code(), grpc::StatusCode::NOT_FOUND);
  status = Get({}, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("subject: must be given"));
  v1::ComputeCostProfilesResponse profile;
  auto profile_request = OneShot<v1::ComputeCostProfilesRequest>(20);
  profile_request.set_point_count(2);
  status = Profile(profile_request, &profile);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "pointCount: 2 must be from 3 to 1001");
  v1::ComputeRegularizationSweepResponse sweep;
  auto sweep_request = OneShot<v1::ComputeRegularizationSweepRequest>(20);
  sweep_request.set_lowest(-1);
  status = Sweep(sweep_request, &sweep);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "lowest: -1 must be from 1e-08 to 1e+08");
}

}  // namespace
}  // namespace polyest::internal
