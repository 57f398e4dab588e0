#include <future>

#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

class SessionRpcTest : public DaemonTest {
 protected:
  grpc::Status Get(const std::string& name, v1::Session* session) {
    grpc::ClientContext context;
    v1::GetSessionRequest request;
    request.set_name(name);
    return sessions_->GetSession(&context, request, session);
  }

  grpc::Status GetEstimate(const std::string& session, v1::Estimate* estimate) {
    grpc::ClientContext context;
    v1::GetEstimateRequest request;
    request.set_session(session);
    v1::Estimate response;
    const grpc::Status status = sessions_->GetEstimate(&context, request, &response);
    *estimate = response;
    return status;
  }
};

TEST_F(SessionRpcTest, CreatesGetsAndDeletesSessions) {
  ASSERT_TRUE(Create("rig").ok());
  EXPECT_EQ(Create("rig").error_code(), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(Create("Rig").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  v1::Session session;
  ASSERT_TRUE(Get("sessions/rig", &session).ok());
  EXPECT_EQ(session.name(), "sessions/rig");
  EXPECT_EQ(session.problem().model().builtin(), "mass_spring_damper");
  EXPECT_GT(session.create_time().seconds(), 0);
  EXPECT_TRUE(Delete("sessions/rig").ok());
  EXPECT_EQ(Delete("sessions/rig").error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(Get("sessions/rig", &session).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(Get("rig", &session).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(SessionRpcTest, LeavesTheProblemOutIfItIsAskedTo) {
  ASSERT_TRUE(Create("rig").ok());
  v1::Session session, without;
  ASSERT_TRUE(Get("sessions/rig", &session).ok());
  grpc::ClientContext context;
  v1::GetSessionRequest request;
  request.set_name("sessions/rig");
  request.set_omit_problem(true);
  ASSERT_TRUE(sessions_->GetSession(&context, request, &without).ok());
  EXPECT_FALSE(without.has_problem());
  EXPECT_EQ(without.name(), session.name());
  EXPECT_EQ(without.create_time().seconds(), session.create_time().seconds());
}

TEST_F(SessionRpcTest, RefusesABadProblemByItsField) {
  v1::Problem problem = Oscillator();
  problem.mutable_measured(0)->set_output("z");
  const grpc::Status status = Create("rig", problem);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), testing::StartsWith("measured[0]: "));
}

TEST_F(SessionRpcTest, ListsSessionsInPagesWithoutTheirProblems) {
  for (const char* id : {"c", "a", "e", "b", "d"}) ASSERT_TRUE(Create(id).ok());
  std::vector<std::string> names;
  v1::ListSessionsRequest request;
  request.set_page_size(2);
  int pages = 0;
  do {
    grpc::ClientContext context;
    v1::ListSessionsResponse response;
    ASSERT_TRUE(sessions_->ListSessions(&context, request, &response).ok());
    for (const auto& session : response.sessions()) {
      names.push_back(session.name());
      EXPECT_FALSE(session.has_problem());
    }
    request.set_page_token(response.next_page_token());
    ++pages;
  } while (!request.page_token().empty());
  EXPECT_EQ(pages, 3);
  EXPECT_THAT(names, testing::ElementsAre("sessions/a", "sessions/b", "sessions/c", "sessions/d",
                                          "sessions/e"));
}

TEST_F(SessionRpcTest, RefusesBadPages) {
  v1::ListSessionsRequest request;
  request.set_page_token("somewhere");
  v1::ListSessionsResponse response;
  grpc::ClientContext context;
  EXPECT_EQ(sessions_->ListSessions(&context, request, &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(SessionRpcTest, AddsMeasurementsOneCallAtATime) {
  ASSERT_TRUE(Create("rig").ok());
  v1::Acknowledgement acknowledgement;
  for (int batch = 0; batch < 3; ++batch) {
    ASSERT_TRUE(Add("sessions/rig", batch + 1, OscillatorRows(20 * batch, 20 * (batch + 1)),
                    &acknowledgement)
                    .ok());
    EXPECT_EQ(acknowledgement.sequence(), batch + 1);
    EXPECT_EQ(acknowledgement.sample_count(), 20 * (batch + 1));
  }
  v1::Estimate estimate;
  ASSERT_TRUE(GetEstimate("sessions/rig", &estimate).ok());
  EXPECT_EQ(estimate.sequence(), 3);
  EXPECT_EQ(WithoutSequence(estimate), WithoutSequence(EstimateAtOnce(60)));
  v1::Session session;
  ASSERT_TRUE(Get("sessions/rig", &session).ok());
  EXPECT_EQ(session.last_sequence(), 3);
  EXPECT_EQ(session.sample_count(), 60);
}

TEST_F(SessionRpcTest, AcknowledgesARepeatAndRefusesGaps) {
  ASSERT_TRUE(Create("rig").ok());
  ASSERT_TRUE(Add("sessions/rig", 1, OscillatorRows(0, 5)).ok());
  v1::Acknowledgement acknowledgement;
  ASSERT_TRUE(Add("sessions/rig", 1, OscillatorRows(0, 5), &acknowledgement).ok());
  EXPECT_EQ(acknowledgement.sample_count(), 5);
  grpc::Status status = Add("sessions/rig", 1, OscillatorRows(0, 6));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_THAT(status.error_message(), testing::HasSubstr("the next batch must be 2"));
  status = Add("sessions/rig", 3, OscillatorRows(5, 6));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(),
              testing::HasSubstr("3 leaves a gap; the next batch must be 2"));
  EXPECT_TRUE(Add("sessions/rig", 2, OscillatorRows(5, 6)).ok());
}

TEST_F(SessionRpcTest, AnswersUnknownSessionsWithNotFound) {
  EXPECT_EQ(Add("sessions/none", 1, OscillatorRows(0, 1)).error_code(),
            grpc::StatusCode::NOT_FOUND);
  v1::Estimate estimate;
  const grpc::Status status = GetEstimate("sessions/none", &estimate);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(status.error_message(), "there is no session \"sessions/none\"");
}

// Without the end of its session the batch would be computed for seconds, and then acknowledged.
TEST_F(SessionRpcTest, EndsABatchThatIsComputedWhenItsSessionIsDeleted) {
  v1::Problem problem = Oscillator();
  problem.mutable_expansion()->set_order(12);
  ASSERT_TRUE(Create("rig", problem).ok());
  std::future<grpc::Status> added = std::async(
      std::launch::async, [this] { return Add("sessions/rig", 1, OscillatorRows(0, 100'000)); });
  v1::GetSessionRequest request;
  request.set_name("sessions/rig");
  v1::Session session;
  while (session.last_sequence() == 0) {
    grpc::ClientContext context;
    ASSERT_TRUE(sessions_->GetSession(&context, request, &session).ok());
  }
  ASSERT_TRUE(Delete("sessions/rig").ok());
  const grpc::Status ended = added.get();
  EXPECT_EQ(ended.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(ended.error_message(), testing::HasSubstr("sessions/rig has been deleted"));
}

class TwoSessionsTest : public DaemonTest {
 protected:
  TwoSessionsTest() : DaemonTest({"--max-sessions", "2"}) {}
};

TEST_F(TwoSessionsTest, AreTheLimitWhenTheLimitIsTwo) {
  ASSERT_TRUE(Create("a").ok());
  ASSERT_TRUE(Create("b").ok());
  EXPECT_EQ(Create("c").error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

}  // namespace
}  // namespace polyest::internal
