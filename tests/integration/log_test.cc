// Tests the daemon's log and the ids of requests.

#include <gmock/gmock.h>

#include <algorithm>

#include "server/telemetry/request_id.h"
#include "tests/integration/operations_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class LogTest : public DaemonTest {
 protected:
  explicit LogTest(const std::string& format = "json")
      : DaemonTest({"--log-level", "debug", "--log-format", format}) {}

  // Asks for a session under this request id; returns the id that comes back.
  std::string Get(const std::string& session, const std::string& id) {
    grpc::ClientContext context;
    context.AddMetadata(kRequestIdKey, id);
    v1::GetSessionRequest request;
    request.set_name(session);
    v1::Session response;
    sessions_->GetSession(&context, request, &response);
    const auto& metadata = context.GetServerInitialMetadata();
    const auto found = metadata.find(kRequestIdKey);
    return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
  }

  // Returns the log line of a call; without fields if there is none.
  google::protobuf::Struct LineOf(const std::string& request) {
    for (const auto& line : JsonLines(daemon_.Errors())) {
      if (Field(line, "request") == request) return line;
    }
    return {};
  }
};

class TextLogTest : public LogTest {
 protected:
  TextLogTest() : LogTest("text") {}
};

TEST_F(LogTest, HasALineForACallWithItsRequestId) {
  ASSERT_TRUE(Create("rig").ok());
  EXPECT_EQ(Get("sessions/rig", "campaign-7.run_3"), "campaign-7.run_3");
  const auto line = LineOf("campaign-7.run_3");
  EXPECT_EQ(Field(line, "level"), "debug");
  EXPECT_EQ(Field(line, "message"), "call");
  EXPECT_EQ(Field(line, "method"), "GetSession");
  EXPECT_EQ(Field(line, "session"), "sessions/rig");
  EXPECT_EQ(Field(line, "tenant"), "default");
  EXPECT_EQ(Field(line, "code"), "OK");
  EXPECT_GE(std::stod(Field(line, "duration_s")), 0);
  EXPECT_THAT(Field(line, "time"), ::testing::MatchesRegex("....-..-..T..:..:..\\.......Z"));
}

// Fifty lines at once and five a second: a minute would have to pass before these were all logged.
TEST_F(LogTest, HasFewLinesOfManyRefusals) {
  constexpr int kCalls = 400;
  for (int i = 0; i < kCalls; ++i) Get("sessions/none", "refused");
  int lines = 0;
  for (const auto& line : JsonLines(daemon_.Errors())) lines += Field(line, "request") == "refused";
  EXPECT_GE(lines, 50);
  EXPECT_LT(lines, kCalls);
  Get("sessions/rig/none", "another");  // another code has lines of its own
  EXPECT_EQ(Field(LineOf("another"), "code"), "INVALID_ARGUMENT");
}

TEST_F(LogTest, GivesARequestAnIdWhereItHasNoneThatIsSane) {
  for (const std::string& bad : {std::string("two words"), std::string(65, 'a')}) {
    const std::string id = Get("sessions/none", bad);
    EXPECT_NE(id, bad);
    EXPECT_TRUE(IsRequestId(id)) << id;
    EXPECT_EQ(Field(LineOf(id), "code"), "NOT_FOUND");
  }
}

TEST_F(LogTest, TellsOfSessionsAsTheyComeAndGo) {
  ASSERT_TRUE(Create("rig").ok());
  ASSERT_TRUE(Delete("sessions/rig").ok());
  std::vector<std::string> told;
  for (const auto& line : JsonLines(daemon_.Errors())) {
    if (Field(line, "session") == "sessions/rig" && Field(line, "level") == "info") {
      told.push_back(Field(line, "method"));
    }
  }
  EXPECT_EQ(told, (std::vector<std::string>{"CreateSession", "DeleteSession"}));
}

TEST_F(LogTest, IsJsonWhateverAClientSends) {
  const std::string name = "sessions/\"a\\b\"\n\x01<é>";
  Get(name, "odd");
  EXPECT_EQ(Field(LineOf("odd"), "session"), name);
}

TEST_F(LogTest, TellsNoMeasurement) {
  ASSERT_TRUE(Create("rig").ok());
  v1::Measurements rows = OscillatorRows(0, 2);
  rows.set_time_s(0, 98765.4321);  // later than the next row
  EXPECT_FALSE(Add("sessions/rig", 1, rows).ok());
  EXPECT_THAT(daemon_.Errors(), Not(HasSubstr("98765")));
}

TEST_F(TextLogTest, KeepsEachLineToItself) {
  ASSERT_TRUE(Create("rig").ok());
  Get("sessions/a\nb c", "odd");
  EXPECT_THAT(daemon_.Errors(),
              HasSubstr("call request=odd method=GetSession session=\"sessions/a\\nb c\""));
}

}  // namespace
}  // namespace polyest::internal
