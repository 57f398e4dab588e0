// Tests computations that are started, polled, cancelled and forgotten.

#include <thread>

#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class OperationRpcTest : public DaemonTest {
 protected:
  using Stub = v1::OperationService::Stub;

  static v1::StartComputationRequest Posterior(const std::string& session) {
    v1::StartComputationRequest request;
    request.mutable_posterior()->mutable_subject()->set_session(session);
    return request;
  }

  // Returns a computation that takes too long to end in a test.
  static v1::StartComputationRequest Endless() {
    v1::StartComputationRequest request;
    v1::ComputePropagationRequest& propagation = *request.mutable_propagation();
    *propagation.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
    propagation.set_until_s(1e5);
    propagation.set_step_s(1);
    return request;
  }

  template <typename Request, typename Response>
  grpc::Status Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response* response) {
    grpc::ClientContext context;
    return (operations_.get()->*method)(&context, request, response);
  }

  v1::Operation Start(const v1::StartComputationRequest& request) {
    v1::Operation operation;
    const grpc::Status status = Call(&Stub::StartComputation, request, &operation);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return operation;
  }

  grpc::Status Get(const std::string& name, v1::Operation* operation) {
    v1::GetOperationRequest request;
    request.set_name(name);
    return Call(&Stub::GetOperation, request, operation);
  }

  // Polls the operation until it is done.
  v1::Operation Await(const std::string& name) {
    v1::Operation operation;
    do {
      std::this_thread::yield();
      const grpc::Status status = Get(name, &operation);
      EXPECT_TRUE(status.ok()) << status.error_message();
      if (!status.ok()) return operation;
    } while (operation.state() == v1::Operation::QUEUED ||
             operation.state() == v1::Operation::RUNNING);
    return operation;
  }

  std::vector<std::string> List(int page_size = 0) {
    v1::ListOperationsRequest request;
    request.set_page_size(page_size);
    v1::ListOperationsResponse response;
    std::vector<std::string> names;
    do {
      EXPECT_TRUE(Call(&Stub::ListOperations, request, &response).ok());
      for (const v1::Operation& operation : response.operations()) {
        names.push_back(operation.name());
        EXPECT_FALSE(operation.has_response());
      }
      request.set_page_token(response.next_page_token());
    } while (!request.page_token().empty());
    return names;
  }
};

TEST_F(OperationRpcTest, AnswersWhatTheCallAnswers) {
  ASSERT_TRUE(Create("rig").ok());
  ASSERT_TRUE(Add("sessions/rig", 1, OscillatorRows(0, 30)).ok());
  const v1::StartComputationRequest request = Posterior("sessions/rig");
  const v1::Operation started = Start(request);
  EXPECT_EQ(started.method(), "ComputePosterior");
  const v1::Operation done = Await(started.name());
  ASSERT_EQ(done.state(), v1::Operation::SUCCEEDED) << done.error().message();
  EXPECT_GE(done.elapsed_time_s(), 0);
  EXPECT_GE(done.end_time().seconds(), done.create_time().seconds());
  grpc::ClientContext context;
  v1::ComputePosteriorResponse answer;
  ASSERT_TRUE(studies_->ComputePosterior(&context, request.posterior(), &answer).ok());
  EXPECT_EQ(done.response().posterior().SerializeAsString(), answer.SerializeAsString());
}

TEST_F(OperationRpcTest, TellsWhyAComputationFailed) {
  v1::StartComputationRequest request;
  *request.mutable_estimate()->mutable_subject()->mutable_experiment()->mutable_problem() =
      Oscillator();
  request.mutable_estimate()
      ->mutable_subject()
      ->mutable_experiment()
      ->mutable_problem()
      ->mutable_uncertain(0)
      ->mutable_uniform()
      ->set_lower(50);
  const v1::Operation failed = Await(Start(request).name());
  EXPECT_EQ(failed.state(), v1::Operation::FAILED);
  EXPECT_EQ(failed.error().code(), static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT));
  EXPECT_THAT(failed.error().message(), HasSubstr("uncertain[0].uniform"));
}

TEST_F(OperationRpcTest, RefusesAtOnceWhatItCannotStart) {
  v1::Operation operation;
  EXPECT_EQ(Call(&Stub::StartComputation, v1::StartComputationRequest(), &operation).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Call(&Stub::StartComputation, Posterior("sessions/none"), &operation).error_code(),
            grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(Call(&Stub::StartComputation, Posterior("none"), &operation).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(List(), ElementsAre());
}

TEST_F(OperationRpcTest, CancelsWhatIsUnderWay) {
  const v1::Operation started = Start(Endless());
  v1::CancelOperationRequest request;
  request.set_name(started.name());
  v1::Operation operation;
  ASSERT_TRUE(Call(&Stub::CancelOperation, request, &operation).ok());
  const v1::Operation cancelled = Await(started.name());
  EXPECT_EQ(cancelled.state(), v1::Operation::CANCELLED);
  EXPECT_EQ(cancelled.error().code(), static_cast<int>(grpc::StatusCode::CANCELLED));
}

TEST_F(OperationRpcTest, ListsByPagesAndForgetsWhatIsDeleted) {
  std::vector<std::string> names;
  for (int i = 0; i < 3; ++i) names.push_back(Start(Endless()).name());
  EXPECT_EQ(List(2), names);
  for (const std::string& name : names) {
    v1::DeleteOperationRequest request;
    request.set_name(name);
    google::protobuf::Empty empty;
    EXPECT_TRUE(Call(&Stub::DeleteOperation, request, &empty).ok());
    v1::Operation operation;
    EXPECT_EQ(Get(name, &operation).error_code(), grpc::StatusCode::NOT_FOUND);
  }
  EXPECT_THAT(List(), ElementsAre());
}

// Tests that the daemon stops within its time although a computation is under way.
TEST_F(OperationRpcTest, LetsTheDaemonStop) {
  const v1::Operation started = Start(Endless());
  v1::Operation operation;
  do {
    ASSERT_TRUE(Get(started.name(), &operation).ok());
  } while (operation.state() == v1::Operation::QUEUED);
  daemon_.Signal(SIGTERM);
  EXPECT_EQ(daemon_.Wait(), 0);
}

}  // namespace
}  // namespace polyest::internal
