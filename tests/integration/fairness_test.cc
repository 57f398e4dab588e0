// Tests that long computations of some clients do not keep others waiting.

#include <future>

#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

class OneThreadTest : public DaemonTest {
 protected:
  OneThreadTest() : DaemonTest({"--threads", "1"}) {}
};

// Returns a long request: order 8 in four unknowns is 495 terms and a thousand trajectories, over
// 20,000 rows.
v1::ComputeEstimateRequest LongRequest() {
  v1::ComputeEstimateRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = ProblemFromJson(R"({
    "model": {"builtin": "mass_spring_damper"},
    "uncertain": [{"name": "k", "uniform": {"lower": 31.58, "upper": 47.37}},
                  {"name": "c", "uniform": {"lower": 0.1, "upper": 0.3}},
                  {"name": "x0", "uniform": {"lower": 0.5, "upper": 1.5}},
                  {"name": "v0", "uniform": {"lower": -1, "upper": 1}}],
    "fixed": {"m": 1},
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}],
    "expansion": {"order": 8, "adaptive": false}
  })");
  *request.mutable_subject()->mutable_experiment()->mutable_measurements() =
      OscillatorRows(0, 20'000);
  return request;
}

TEST_F(OneThreadTest, StreamsWhileLongRequestsAreComputed) {
  constexpr int kRequests = 3;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::future<grpc::Status>> answers;
  for (int i = 0; i < kRequests; ++i) {
    grpc::ClientContext& context = *contexts.emplace_back(std::make_unique<grpc::ClientContext>());
    answers.push_back(std::async(std::launch::async, [this, &context] {
      v1::ComputeEstimateResponse response;
      return studies_->ComputeEstimate(&context, LongRequest(), &response);
    }));
  }
  ASSERT_TRUE(Create("rig").ok());
  for (int batch = 1; batch <= 10; ++batch) {
    ASSERT_TRUE(Add("sessions/rig", batch, OscillatorRows(5 * (batch - 1), 5 * batch)).ok());
  }
  ClientStream stream(*sessions_);
  ASSERT_TRUE(stream.Send("sessions/rig", 11, OscillatorRows(50, 55)));
  stream.ExpectAcknowledgement(11);
  v1::Estimate estimate;
  stream.ExpectEstimate(estimate);
  EXPECT_EQ(estimate.samples(), 55);
  for (int i = 0; i < kRequests; ++i) {
    EXPECT_EQ(answers[static_cast<size_t>(i)].wait_for(std::chrono::seconds(0)),
              std::future_status::timeout)
        << "the request was not long enough to show anything";
    contexts[static_cast<size_t>(i)]->TryCancel();
  }
  for (auto& answer : answers) {
    EXPECT_EQ(answer.get().error_code(), grpc::StatusCode::CANCELLED);
  }
}

class OneSecondTest : public DaemonTest {
 protected:
  OneSecondTest() : DaemonTest({"--max-compute-s", "1"}) {}
};

TEST_F(OneSecondTest, EndsARequestThatIsComputedForLonger) {
  grpc::ClientContext context;
  v1::ComputeEstimateResponse response;
  const grpc::Status status = studies_->ComputeEstimate(&context, LongRequest(), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(status.error_message(),
            "the request was computed for 1 s, the longest that one may be (--max-compute-s)");
  // The caller's own deadline gives another error.
  grpc::ClientContext hurried;
  hurried.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(100));
  EXPECT_EQ(studies_->ComputeEstimate(&hurried, LongRequest(), &response).error_code(),
            grpc::StatusCode::DEADLINE_EXCEEDED);
}

}  // namespace
}  // namespace polyest::internal
