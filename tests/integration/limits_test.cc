// Tests every limit of a tenant, a problem or the daemon: a request beyond a limit is refused by
// the limit's name.

#include <grpcpp/support/error_details.h>

#include "polyest/rpc/error_details.pb.h"
#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {
namespace {

template <typename Detail>
bool Find(const grpc::Status& status, Detail& found) {
  rpc::Status detailed;
  EXPECT_TRUE(grpc::ExtractErrorDetails(status, &detailed).ok());
  const std::string type = "type.googleapis.com/google.rpc." + found.GetDescriptor()->name();
  for (const auto& detail : detailed.details()) {
    if (detail.type_url() == type) return found.ParseFromString(detail.value());
  }
  return false;
}

// Expects a refusal that names this option.
void ExpectLimit(const grpc::Status& status, const std::string& option) {
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_THAT(status.error_message(), testing::HasSubstr("(" + option + ")"));
  rpc::QuotaFailure quota;
  ASSERT_TRUE(Find(status, quota));
  ASSERT_EQ(quota.violations_size(), 1);
  EXPECT_EQ(quota.violations(0).subject(), option);
  rpc::ErrorInfo info;
  ASSERT_TRUE(Find(status, info));
  EXPECT_EQ(info.domain(), "polyest");
}

void ExpectLimitForGood(const grpc::Status& status, const std::string& option) {
  ExpectLimit(status, option);
  rpc::RetryInfo retry;
  EXPECT_FALSE(Find(status, retry));
}

class LimitsTest : public DaemonTest {
 protected:
  explicit LimitsTest(std::vector<std::string> arguments = {}) : DaemonTest(std::move(arguments)) {}

  grpc::Status Estimate(const v1::Problem& problem = Oscillator()) {
    grpc::ClientContext context;
    v1::ComputeEstimateRequest request;
    *request.mutable_subject()->mutable_experiment()->mutable_problem() = problem;
    *request.mutable_subject()->mutable_experiment()->mutable_measurements() =
        OscillatorRows(0, 10);
    v1::ComputeEstimateResponse response;
    return studies_->ComputeEstimate(&context, request, &response);
  }
  grpc::Status Propagate() {
    grpc::ClientContext context;
    v1::ComputePropagationRequest request;
    *request.mutable_subject()->mutable_experiment()->mutable_problem() = Oscillator();
    request.set_until_s(1);
    request.set_step_s(0.5);
    v1::ComputePropagationResponse response;
    return studies_->ComputePropagation(&context, request, &response);
  }
  // Expects the problem to be refused with a session, without one, and without measurements.
  void ExpectProblemRefused(const std::string& option) {
    ExpectLimitForGood(Create("rig"), option);
    ExpectLimitForGood(Estimate(), option);
    ExpectLimitForGood(Propagate(), option);
  }
};

struct FewSessionsTest : LimitsTest {
  FewSessionsTest() : LimitsTest({"--max-sessions", "2", "--max-sessions-per-tenant", "1"}) {}
};
TEST_F(FewSessionsTest, NamesTheLimitOfATenantsSessions) {
  ASSERT_TRUE(Create("a").ok());
  ExpectLimitForGood(Create("b"), "--max-sessions-per-tenant");
}

struct OneParameterTest : LimitsTest {
  OneParameterTest() : LimitsTest({"--max-parameters", "1"}) {}
};
TEST_F(OneParameterTest, NamesTheLimitOfParameters) { ExpectProblemRefused("--max-parameters"); }

struct OneStateTest : LimitsTest {
  OneStateTest() : LimitsTest({"--max-states", "1"}) {}
};
TEST_F(OneStateTest, NamesTheLimitOfStates) { ExpectProblemRefused("--max-states"); }

struct FewPointsTest : LimitsTest {
  FewPointsTest() : LimitsTest({"--max-points", "109"}) {}
};
TEST_F(FewPointsTest, NamesTheLimitOfPoints) {
  ExpectProblemRefused("--max-points");
  // The limit admits a lower order.
  v1::Problem problem = Oscillator();
  problem.mutable_expansion()->set_order(3);
  EXPECT_TRUE(Create("rig", problem).ok());
  EXPECT_TRUE(Estimate(problem).ok());
}

struct FewRowsOfABatchTest : LimitsTest {
  FewRowsOfABatchTest() : LimitsTest({"--max-batch-rows", "3", "--max-session-rows", "5"}) {}
};
TEST_F(FewRowsOfABatchTest, NamesTheLimitsOfRowsOfABatchAndOfASession) {
  ASSERT_TRUE(Create("rig").ok());
  ExpectLimitForGood(Add("sessions/rig", 1, OscillatorRows(0, 4)), "--max-batch-rows");
  ASSERT_TRUE(Add("sessions/rig", 1, OscillatorRows(0, 3)).ok());
  ExpectLimitForGood(Add("sessions/rig", 2, OscillatorRows(3, 6)), "--max-session-rows");
  EXPECT_TRUE(Add("sessions/rig", 2, OscillatorRows(3, 5)).ok());
}

// Tests a limit of stored rows, across the sessions, deletions and restarts of a daemon.
void ExpectRowsLimited(const std::string& option) {
  const TestFolder data;
  struct Served : LimitsTest {
    Served(const std::string& folder, const std::string& limit)
        : LimitsTest({"--data-dir", folder, limit, "25"}) {
      SetUp();
    }
    void TestBody() override {}
    using LimitsTest::Add, LimitsTest::Create, LimitsTest::Delete;
  };
  {
    Served daemon(data.path(), option);
    ASSERT_TRUE(daemon.Create("a").ok());
    ASSERT_TRUE(daemon.Create("b").ok());
    ASSERT_TRUE(daemon.Add("sessions/a", 1, OscillatorRows(0, 20)).ok());
    ExpectLimitForGood(daemon.Add("sessions/b", 1, OscillatorRows(0, 6)), option);
  }
  Served daemon(data.path(), option);
  ExpectLimitForGood(daemon.Add("sessions/b", 1, OscillatorRows(0, 6)), option);
  // A repeated batch needs no room.
  EXPECT_TRUE(daemon.Add("sessions/a", 1, OscillatorRows(0, 20)).ok());
  EXPECT_TRUE(daemon.Add("sessions/b", 1, OscillatorRows(0, 5)).ok());
  ASSERT_TRUE(daemon.Delete("sessions/a").ok());
  EXPECT_TRUE(daemon.Add("sessions/b", 2, OscillatorRows(5, 25)).ok());
}
TEST(StoredRowsTest, NamesTheLimitOfATenantsRows) { ExpectRowsLimited("--max-tenant-rows"); }
TEST(StoredRowsTest, NamesTheLimitOfAllRows) { ExpectRowsLimited("--max-total-rows"); }

// The limit is below the memory of any process.
struct NoMemoryTest : LimitsTest {
  NoMemoryTest() : LimitsTest({"--max-memory-mb", "1"}) {}
};
TEST_F(NoMemoryTest, NamesTheLimitOfMemoryAndWhenToTryAgain) {
  for (const grpc::Status& status : {Create("rig"), Estimate(), Propagate()}) {
    ExpectLimit(status, "--max-memory-mb");
    rpc::RetryInfo retry;
    ASSERT_TRUE(Find(status, retry));
    EXPECT_GT(retry.retry_delay().seconds(), 0);
  }
}

TEST(MemoryLimitTest, AffectsNothingThatIsAcknowledged) {
  const TestFolder data;
  struct Served : LimitsTest {
    Served(std::vector<std::string> arguments) : LimitsTest(std::move(arguments)) { SetUp(); }
    void TestBody() override {}
    using LimitsTest::Add, LimitsTest::Create, LimitsTest::sessions_;
  };
  {
    Served daemon({"--data-dir", data.path()});
    ASSERT_TRUE(daemon.Create("rig").ok());
    ASSERT_TRUE(daemon.Add("sessions/rig", 1, OscillatorRows(0, 20)).ok());
  }
  {
    Served daemon({"--data-dir", data.path(), "--max-memory-mb", "1"});
    // The session is neither in memory nor let in, but it is stored.
    ExpectLimit(daemon.Add("sessions/rig", 2, OscillatorRows(20, 30)), "--max-memory-mb");
    grpc::ClientContext context;
    v1::GetSessionRequest get;
    get.set_name("sessions/rig");
    v1::Session session;
    ASSERT_TRUE(daemon.sessions_->GetSession(&context, get, &session).ok());
    EXPECT_EQ(session.sample_count(), 20);
  }
  Served daemon({"--data-dir", data.path()});
  EXPECT_TRUE(daemon.Add("sessions/rig", 2, OscillatorRows(20, 30)).ok());
}

struct SmallMessagesTest : LimitsTest {
  SmallMessagesTest() : LimitsTest({"--max-message-mb", "1"}) {}
};
TEST_F(SmallMessagesTest, AreRefusedByGrpcItself) {
  ASSERT_TRUE(Create("rig").ok());
  const grpc::Status status = Add("sessions/rig", 1, OscillatorRows(0, 100'000));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

struct UnlimitedTest : LimitsTest {};
TEST_F(UnlimitedTest, NamesTheFieldOfABadRequest) {
  v1::Problem problem = Oscillator();
  problem.mutable_uncertain(0)->mutable_uniform()->set_lower(99);
  const grpc::Status status = Create("rig", problem);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  rpc::BadRequest bad;
  ASSERT_TRUE(Find(status, bad));
  ASSERT_EQ(bad.field_violations_size(), 1);
  EXPECT_EQ(bad.field_violations(0).field(), "uncertain[0].uniform");
  EXPECT_EQ(status.error_message(),
            "uncertain[0].uniform: " + bad.field_violations(0).description());
}

}  // namespace
}  // namespace polyest::internal
