#include "server/service/unary_call.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "polyest/v1/session_service.grpc.pb.h"
#include "server/service/services.h"
#include "tests/testing/problem_json.h"
#include "tests/unit/server/service/service_fixture.h"

namespace polyest::internal {
namespace {

// Serves the sessions.
class UnaryCallTest : public ServiceTest {
 protected:
  void SetUp() override {
    ServiceTest::SetUp();
    service_ = MakeSessionService(Context());
    grpc::ServerBuilder builder;
    builder.RegisterService(service_.get());
    server_ = builder.BuildAndStart();
    stub_ = v1::SessionService::NewStub(server_->InProcessChannel({}));
  }
  void TearDown() override { server_->Shutdown(); }

  grpc::Status Create(const v1::Problem& problem) {
    grpc::ClientContext context;
    v1::CreateSessionRequest request;
    request.set_session_id("a");
    *request.mutable_session()->mutable_problem() = problem;
    v1::Session session;
    return stub_->CreateSession(&context, request, &session);
  }

  std::unique_ptr<grpc::Service> service_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<v1::SessionService::Stub> stub_;
};

// Returns a problem whose session is no small answer.
v1::Problem LargeProblem() {
  v1::Problem problem = SmallProblem();
  v1::Input& force = *problem.add_inputs();
  force.set_name("force");
  for (int k = 0; k < 1'000; ++k) {
    force.mutable_table()->add_time_s(k);
    force.mutable_table()->add_value(0);
  }
  return problem;
}

TEST_F(UnaryCallTest, CreatesNoSessionWhoseAnswerHasNoRoom) {
  auto unread = calls_.Enter(OpenCalls::Kind::kUnary, "default").value();
  ASSERT_TRUE(unread->HoldAnswer(OpenCalls::kMaxUnreadBytes - 1).ok());
  const grpc::Status refused = Create(LargeProblem());
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << refused.error_message();
  EXPECT_TRUE(sessions_->All().empty());
  unread = nullptr;
  const grpc::Status created = Create(LargeProblem());
  EXPECT_TRUE(created.ok()) << created.error_message();
}

TEST_F(UnaryCallTest, CreatesASmallSessionWhateverIsLeftUnread) {
  const auto unread = calls_.Enter(OpenCalls::Kind::kUnary, "default").value();
  ASSERT_TRUE(unread->HoldAnswer(OpenCalls::kMaxUnreadBytes - 1).ok());
  EXPECT_TRUE(Create(SmallProblem()).ok());
}

}  // namespace
}  // namespace polyest::internal
