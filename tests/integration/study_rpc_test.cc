// Tests that each study of a session equals that of the same experiment, and that every client can
// have problems checked and read the schema.

#include "proto/problem_schema.h"
#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class StudyRpcTest : public DaemonTest {
 protected:
  static constexpr int kRows = 20;

  void SetUp() override {
    DaemonTest::SetUp();
    ASSERT_TRUE(Create("rig").ok());
    ASSERT_TRUE(Add("sessions/rig", 1, OscillatorRows(0, 10)).ok());
    ASSERT_TRUE(Add("sessions/rig", 2, OscillatorRows(10, kRows)).ok());
  }

  // Makes the study of the session and of the experiment; returns both answers.
  template <typename Request, typename Response>
  std::pair<Response, Response> Both(grpc::Status (v1::StudyService::Stub::*method)(
                                         grpc::ClientContext*, const Request&, Response*),
                                     Request request) {
    std::pair<Response, Response> answers;
    grpc::ClientContext of_session, of_experiment;
    request.mutable_subject()->set_session("sessions/rig");
    const grpc::Status first = (studies_.get()->*method)(&of_session, request, &answers.first);
    EXPECT_TRUE(first.ok()) << first.error_message();
    v1::Experiment& experiment = *request.mutable_subject()->mutable_experiment();
    *experiment.mutable_problem() = Oscillator();
    *experiment.mutable_measurements() = OscillatorRows(0, kRows);
    const grpc::Status second = (studies_.get()->*method)(&of_experiment, request, &answers.second);
    EXPECT_TRUE(second.ok()) << second.error_message();
    return answers;
  }

  template <typename Response>
  static void ExpectSameButForTheBatch(std::pair<Response, Response> answers) {
    EXPECT_EQ(answers.first.sequence(), 2);
    EXPECT_EQ(answers.second.sequence(), 0);
    answers.first.clear_sequence();
    EXPECT_EQ(answers.first.SerializeAsString(), answers.second.SerializeAsString());
  }
};

TEST_F(StudyRpcTest, EstimatesTheSameOfASessionAndAtOnce) {
  const auto [of_session, at_once] =
      Both(&v1::StudyService::Stub::ComputeEstimate, v1::ComputeEstimateRequest());
  EXPECT_EQ(of_session.estimate().sequence(), 2);
  EXPECT_EQ(WithoutSequence(of_session.estimate()), WithoutSequence(at_once.estimate()));
}

TEST_F(StudyRpcTest, PropagatesThePriorOfASession) {
  v1::ComputePropagationRequest request;
  request.set_until_s(1);
  request.set_step_s(0.5);
  const auto [of_session, at_once] = Both(&v1::StudyService::Stub::ComputePropagation, request);
  EXPECT_THAT(of_session.time_s(), ElementsAre(0, 0.5, 1));
  EXPECT_EQ(of_session.SerializeAsString(), at_once.SerializeAsString());
}

TEST_F(StudyRpcTest, AnalyzesTheSensitivityOfASession) {
  v1::ComputeSensitivityRequest request;
  request.set_until_s(1);
  request.set_step_s(0.5);
  const auto [of_session, at_once] = Both(&v1::StudyService::Stub::ComputeSensitivity, request);
  EXPECT_THAT(of_session.parameters(), ElementsAre("k", "c"));
  EXPECT_EQ(of_session.SerializeAsString(), at_once.SerializeAsString());
}

TEST_F(StudyRpcTest, DrawsTheCostOfASessionOverTheRowsThatItKeeps) {
  v1::ComputeCostGridRequest request;
  request.set_point_count(5);
  ExpectSameButForTheBatch(Both(&v1::StudyService::Stub::ComputeCostGrid, request));
}

TEST_F(StudyRpcTest, DesignsTheNextExperimentOfASession) {
  v1::ComputeExperimentDesignRequest request;
  request.set_until_s(1);
  request.set_step_s(0.25);
  request.set_sample_count(1);
  ExpectSameButForTheBatch(Both(&v1::StudyService::Stub::ComputeExperimentDesign, request));
}

TEST_F(StudyRpcTest, ChecksProblemsAndTellsEverythingAtOnce) {
  v1::CheckProblemRequest request;
  *request.mutable_problem() = Oscillator();
  request.mutable_problem()->mutable_uncertain(0)->mutable_uniform()->set_lower(50);
  request.mutable_problem()->mutable_measured(0)->set_output("y");
  v1::CheckProblemResponse response;
  grpc::ClientContext bad;
  ASSERT_TRUE(problems_->CheckProblem(&bad, request, &response).ok());
  ASSERT_EQ(response.errors_size(), 2) << response.DebugString();
  EXPECT_EQ(response.errors(0).field(), "uncertain[0].uniform");
  EXPECT_THAT(response.errors(0).description(), HasSubstr("50"));
  EXPECT_THAT(response.errors(1).description(), HasSubstr("y"));
  EXPECT_THAT(response.summary(), IsEmpty());

  *request.mutable_problem() = Oscillator();
  *request.mutable_measurements() = OscillatorRows(0, 10);
  grpc::ClientContext good;
  ASSERT_TRUE(problems_->CheckProblem(&good, request, &response).ok());
  EXPECT_THAT(response.errors(), IsEmpty()) << response.DebugString();
  ASSERT_THAT(response.summary(), Not(IsEmpty()));
  EXPECT_EQ(response.summary(0).topic(), "model");
  EXPECT_EQ(response.summary(0).name(), "mass_spring_damper");
  EXPECT_THAT(response.DebugString(), HasSubstr("10 rows"));

  request.mutable_measurements()->set_time_s(3, 0);
  grpc::ClientContext disordered;
  ASSERT_TRUE(problems_->CheckProblem(&disordered, request, &response).ok());
  EXPECT_EQ(response.errors_size(), 1) << response.DebugString();
}

TEST_F(StudyRpcTest, GivesTheSchemaThatTheCommandPrints) {
  grpc::ClientContext context;
  v1::GetProblemSchemaResponse response;
  ASSERT_TRUE(problems_->GetProblemSchema(&context, {}, &response).ok());
  EXPECT_EQ(response.json_schema(), kProblemSchema);
}

}  // namespace
}  // namespace polyest::internal
