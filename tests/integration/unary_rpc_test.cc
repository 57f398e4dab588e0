#include <thread>

#include "proto/wire/operations/operations.h"
#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class UnaryRpcTest : public DaemonTest {};

TEST_F(UnaryRpcTest, ListsModelsAndDescribesOne) {
  grpc::ClientContext listing;
  v1::ListModelsResponse models;
  ASSERT_TRUE(models_->ListModels(&listing, {}, &models).ok());
  const auto local = ListModels({});
  ASSERT_TRUE(local.ok()) << local.status();
  ASSERT_GE(models.models_size(), 1);
  EXPECT_EQ(models.SerializeAsString(), local->SerializeAsString());
  grpc::ClientContext getting;
  v1::GetModelRequest request;
  request.set_name(models.models(0).name());
  v1::Model model;
  ASSERT_TRUE(models_->GetModel(&getting, request, &model).ok());
  EXPECT_EQ(model.SerializeAsString(), models.models(0).SerializeAsString());
  grpc::ClientContext missing;
  request.set_name("models/rocket");
  const grpc::Status status = models_->GetModel(&missing, request, &model);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("duffing"));
}

TEST_F(UnaryRpcTest, EstimatesWhatTheLibraryEstimatesToTheLastBit) {
  const v1::Estimate remote = EstimateAtOnce(60);
  v1::ComputeEstimateRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
  *request.mutable_subject()->mutable_experiment()->mutable_measurements() = OscillatorRows(0, 60);
  const auto local = ComputeEstimate(request, 1, {});
  ASSERT_TRUE(local.ok()) << local.status();
  EXPECT_EQ(WithoutSequence(remote), WithoutSequence(local->estimate()));
  // The truth lies within 4 standard deviations.
  EXPECT_NEAR(remote.parameters(0).map(), 40.66, 4 * remote.parameters(0).std_dev());
  EXPECT_EQ(remote.samples(), 60);
}

TEST_F(UnaryRpcTest, PropagatesThePrior) {
  grpc::ClientContext context;
  v1::ComputePropagationRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
  request.set_until_s(1);
  request.set_step_s(0.25);
  v1::ComputePropagationResponse response;
  const grpc::Status status = studies_->ComputePropagation(&context, request, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_EQ(response.time_s_size(), 5);
  ASSERT_EQ(response.outputs_size(), 1);
  // x(0) is known to be 1.
  EXPECT_NEAR(response.outputs(0).mean(0), 1, 1e-12);
  EXPECT_NEAR(response.outputs(0).std_dev(0), 0, 1e-12);
  EXPECT_GT(response.outputs(0).std_dev(3), 0);
  EXPECT_EQ(response.outputs(0).quantiles_size(), 15);
}

TEST_F(UnaryRpcTest, EvaluatesTheCostOnAGrid) {
  grpc::ClientContext context;
  v1::ComputeCostGridRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
  *request.mutable_subject()->mutable_experiment()->mutable_measurements() = OscillatorRows(0, 20);
  request.add_parameters("k");
  request.set_point_count(21);
  v1::ComputeCostGridResponse response;
  const grpc::Status status = studies_->ComputeCostGrid(&context, request, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_EQ(response.axes_size(), 1);
  EXPECT_EQ(response.axes(0).parameter(), "k");
  EXPECT_EQ(response.axes(0).unit(), "N/m");
  ASSERT_EQ(response.axes(0).value_size(), 21);
  ASSERT_EQ(response.total_size(), 21);
  for (int i = 0; i < 21; ++i) {
    EXPECT_DOUBLE_EQ(response.total(i), response.mismatch(i) + response.prior(i));
  }
}

TEST_F(UnaryRpcTest, AnswersBadInputWithItsPlaceAndGoesOn) {
  grpc::ClientContext context;
  v1::ComputeEstimateRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
  request.mutable_subject()
      ->mutable_experiment()
      ->mutable_problem()
      ->mutable_uncertain(0)
      ->mutable_uniform()
      ->set_lower(50);
  v1::ComputeEstimateResponse response;
  grpc::Status status = studies_->ComputeEstimate(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "uncertain[0].uniform: lower 50 must be below upper 47.37");

  grpc::ClientContext empty;
  status = studies_->ComputeEstimate(&empty, {}, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), StartsWith("subject: "));

  grpc::ClientContext again;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
  *request.mutable_subject()->mutable_experiment()->mutable_measurements() = OscillatorRows(0, 5);
  request.mutable_subject()
      ->mutable_experiment()
      ->mutable_measurements()
      ->mutable_channels(0)
      ->set_name("y");
  status = studies_->ComputeEstimate(&again, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("\"y\""));
  EXPECT_EQ(EstimateAtOnce(5).samples(), 5);
}

class SingleThreadTest : public DaemonTest {
 protected:
  SingleThreadTest() : DaemonTest({"--threads", "1", "--max-message-mb", "1"}) {}

  // Returns a request of hundreds of terms over thousands of rows, far more work than the deadlines
  // below allow.
  v1::ComputeEstimateRequest LongWork() {
    v1::ComputeEstimateRequest request;
    *request.mutable_subject()->mutable_experiment()->mutable_problem() = ProblemFromJson(R"({
      "model": {"builtin": "mass_spring_damper"},
      "uncertain": [{"name": "m", "uniform": {"lower": 0.9, "upper": 1.1}},
                    {"name": "k", "uniform": {"lower": 31.58, "upper": 47.37}},
                    {"name": "c", "uniform": {"lower": 0.1, "upper": 0.3}},
                    {"name": "x0", "uniform": {"lower": 0.9, "upper": 1.1}},
                    {"name": "v0", "uniform": {"lower": -0.1, "upper": 0.1}}],
      "measured": [{"output": "x", "noise": {"absolute": 0.01}}],
      "expansion": {"order": 6, "adaptive": false},
      "integration": {"relativeTolerance": 1e-12}
    })");
    *request.mutable_subject()->mutable_experiment()->mutable_measurements() =
        OscillatorRows(0, 20'000);
    return request;
  }

  bool SmallCallComesThrough(std::chrono::milliseconds time) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + time);
    v1::ComputePropagationRequest request;
    *request.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
    request.set_until_s(0.1);
    request.set_step_s(0.1);
    v1::ComputePropagationResponse response;
    return studies_->ComputePropagation(&context, request, &response).ok();
  }
};

TEST_F(SingleThreadTest, AbandonsWorkWhoseDeadlineHasPassed) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(100));
  v1::ComputeEstimateResponse response;
  EXPECT_EQ(studies_->ComputeEstimate(&context, LongWork(), &response).error_code(),
            grpc::StatusCode::DEADLINE_EXCEEDED);
  // The one thread is free again: this call would otherwise wait for the long work.
  EXPECT_EQ(EstimateAtOnce(5).samples(), 5);
}

TEST_F(SingleThreadTest, AbandonsWorkThatIsCancelled) {
  grpc::ClientContext context;
  v1::ComputeEstimateResponse response;
  const v1::ComputeEstimateRequest request = LongWork();
  std::jthread caller([&] {
    EXPECT_EQ(studies_->ComputeEstimate(&context, request, &response).error_code(),
              grpc::StatusCode::CANCELLED);
  });
  // A small call that does not come through shows that the long call has the thread.
  while (SmallCallComesThrough(std::chrono::milliseconds(100))) {
  }
  context.TryCancel();
  caller.join();
  EXPECT_EQ(EstimateAtOnce(5).samples(), 5);
}

TEST_F(SingleThreadTest, RefusesMessagesThatAreTooLarge) {
  grpc::ClientContext context;
  v1::ComputeEstimateRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
  *request.mutable_subject()->mutable_experiment()->mutable_measurements() =
      OscillatorRows(0, 100'000);  // 1.6 MB
  v1::ComputeEstimateResponse response;
  EXPECT_EQ(studies_->ComputeEstimate(&context, request, &response).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(EstimateAtOnce(5).samples(), 5);
}

}  // namespace
}  // namespace polyest::internal
