// Tests the calls of the HTTP port against the same calls by gRPC.

#include <chrono>

#include "tests/integration/web_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

class WebCallsTest : public WebTest {};

TEST_F(WebCallsTest, ListCreateAddAndEstimateAsGrpcDoes) {
  EXPECT_EQ(web_->Post("SessionService/ListSessions", "").body,
            R"({"sessions":[],"nextPageToken":""})");
  const WebAnswer created = web_->Post("SessionService/CreateSession", CreateJson("rig"));
  ASSERT_EQ(created.status, 200) << created.body;
  EXPECT_EQ(created.Header("Content-Type"), "application/json");
  v1::Session session;
  ASSERT_TRUE(FromJson(created.body, session).ok());
  EXPECT_EQ(session.name(), "sessions/rig");
  const WebAnswer added = web_->Post("SessionService/AddMeasurements",
                                     AddJson("sessions/rig", 1, OscillatorRows(0, 50)));
  ASSERT_EQ(added.status, 200) << added.body;
  EXPECT_THAT(added.body, HasSubstr(R"("sequence":"1")"));

  const WebAnswer estimate =
      web_->Post("SessionService/GetEstimate", R"({"session": "sessions/rig"})");
  ASSERT_EQ(estimate.status, 200) << estimate.body;
  EXPECT_EQ(estimate.body, ToJson(EstimateOf("sessions/rig"), false));
  EXPECT_THAT(web_->Post("SessionService/ListSessions", "{}").body,
              HasSubstr(R"("name":"sessions/rig")"));
}

TEST_F(WebCallsTest, TakeAProblemFileAsItIs) {
  const WebAnswer checked = web_->Post("ProblemService/CheckProblem", R"({"problem": {
    "model": {"builtin": "mass_spring_damper"}, "fixed": {"m": 1, "x0": 1},
    "uncertain": [{"name": "k", "uniform": {"lower": 31.58, "upper": 47.37}},
                  {"name": "c", "uniform": {"lower": 0.1, "upper": 0.3}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}],
    "expansion": {"order": "AUTO"}}})");
  EXPECT_EQ(checked.status, 200) << checked.body;
}

TEST_F(WebCallsTest, FailAsGrpcDoesWithItsDetails) {
  const WebAnswer unknown = web_->Post("SessionService/GetSession", R"({"name": "sessions/x"})");
  EXPECT_EQ(unknown.status, 404);
  EXPECT_EQ(unknown.Code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(unknown.Message(), "there is no session \"sessions/x\"");

  v1::Problem problem = Oscillator();
  problem.mutable_measured(0)->mutable_noise()->set_absolute(-1);
  v1::CreateSessionRequest request;
  *request.mutable_session()->mutable_problem() = problem;
  const WebAnswer invalid = web_->Post("SessionService/CreateSession", ToJson(request, false));
  EXPECT_EQ(invalid.status, 400);
  EXPECT_EQ(invalid.Code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(invalid.Message(), Create("x", problem).error_message());
  EXPECT_THAT(invalid.body,
              HasSubstr(R"("@type":"type.googleapis.com/google.rpc.BadRequest",)"
                        R"("fieldViolations":[{"field":"measured[0].noise.absolute",)"));

  ASSERT_TRUE(Create("rig").ok());
  EXPECT_EQ(web_->Post("SessionService/CreateSession", CreateJson("rig")).status, 409);
}

TEST_F(WebCallsTest, AreRefusedWhenTheyAreNoMessageOfTheMethod) {
  const WebAnswer malformed = web_->Post("SessionService/GetSession", "{\n\"name\": sessions}");
  EXPECT_EQ(malformed.status, 400);
  EXPECT_THAT(malformed.Message(), HasSubstr("line 2"));
  const WebAnswer field = web_->Post("SessionService/GetSession", R"({"nmae": "sessions/x"})");
  EXPECT_EQ(field.status, 400);
  EXPECT_EQ(field.Message(), "nmae: unknown field; did you mean \"name\"?");
}

TEST_F(WebCallsTest, NeedTheirPathTheirMethodAndTheirContentType) {
  for (const char* method : {"SessionService/Nothing", "Nothing/GetSession", "x", ""}) {
    const WebAnswer answer = web_->Post(method, "{}");
    EXPECT_EQ(answer.status, 404) << method;
    EXPECT_EQ(answer.Code(), grpc::StatusCode::NOT_FOUND);
  }
  EXPECT_EQ(web_->Get("/nothing").status, 404);
  const WebAnswer got = web_->Get("/v1/SessionService/ListSessions");
  EXPECT_EQ(got.status, 405);
  EXPECT_EQ(got.Header("Allow"), "POST");
  EXPECT_EQ(web_->client().Put("/")->status, 405);
  for (const char* type : {"text/plain", "application/x-www-form-urlencoded", "multipart/form-data",
                           "application/jsonp", ""}) {
    const auto answer = web_->client().Post("/v1/SessionService/ListSessions", "{}", type);
    ASSERT_TRUE(answer) << type;
    EXPECT_EQ(answer->status, 415) << type;
  }
  const auto charset = web_->client().Post("/v1/SessionService/ListSessions", "{}",
                                           "Application/JSON; charset=utf-8");
  EXPECT_EQ(charset->status, 200);
}

TEST_F(WebCallsTest, SayWhatToDoInsteadOfAStreamOfRequests) {
  const WebAnswer stream = web_->Post("SessionService/StreamMeasurements", "{}");
  EXPECT_EQ(stream.status, 501);
  EXPECT_EQ(stream.Code(), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_THAT(stream.Message(), HasSubstr("AddMeasurements"));
  EXPECT_THAT(web_->Post("SessionService/ImportSession", "{}").Message(),
              HasSubstr("polyest import"));
}

TEST_F(WebCallsTest, EndAtTheTimeLimitThatTheyName) {
  ASSERT_TRUE(Create("rig").ok());
  ASSERT_TRUE(Add("sessions/rig", 1, OscillatorRows(0, 5)).ok());
  // A watch lasts until something ends it.
  std::vector<WebEvent> events;
  const WebAnswer answer =
      web_->Stream("SessionService/WatchSession", R"({"session": "sessions/rig"})",
                   [&](const WebEvent& event) {
                     events.push_back(event);
                     return true;
                   },
                   {{"Grpc-Timeout", "100m"}});
  // A slow machine may be late with the first event, too.
  EXPECT_EQ(answer.status, events.empty() ? 504 : 200);
  EXPECT_THAT(events.empty() ? answer.body : events.back().data, HasSubstr("\"code\":4,"));
  EXPECT_EQ(web_->Post("SessionService/ListSessions", "{}", {{"Grpc-Timeout", "60S"}}).status, 200);
  EXPECT_EQ(web_->Post("SessionService/ListSessions", "{}", {{"Grpc-Timeout", "soon"}}).status,
            400);
}

TEST_F(WebCallsTest, CarryTheIdOfTheRequest) {
  EXPECT_EQ(web_->Post("SessionService/ListSessions", "{}", {{"X-Request-Id", "mine-7"}})
                .Header("x-request-id"),
            "mine-7");
  EXPECT_FALSE(web_->Post("SessionService/ListSessions", "{}").Header("x-request-id").empty());
}

TEST_F(WebCallsTest, AreLoggedWithTheirClientsAddress) {
  web_->Post("SessionService/GetSession", R"({"name": "sessions/x"})");
  EXPECT_THAT(daemon_.Errors(), HasSubstr("peer=ipv4:127.0.0.1:"));
  // Nobody can say so of himself.
  grpc::ClientContext context;
  context.AddMetadata("x-polyest-web-peer", "ipv4:192.0.2.99:1");
  context.AddMetadata("x-polyest-web-secret", "guess");
  v1::GetSessionRequest request;
  request.set_name("sessions/y");
  v1::Session session;
  EXPECT_FALSE(sessions_->GetSession(&context, request, &session).ok());
  EXPECT_THAT(daemon_.Errors(), HasSubstr("session=sessions/y"));
  EXPECT_THAT(daemon_.Errors(), ::testing::Not(HasSubstr("192.0.2.99")));
}

class SmallWebCallsTest : public WebTest {
 protected:
  SmallWebCallsTest() : WebTest({"--max-message-mb", "1"}) {}
};

TEST_F(SmallWebCallsTest, AreRefusedWhenTheyAreTooLarge) {
  const std::string large = R"({"name": ")" + std::string(std::size_t{1} << 20, 'x') + R"("})";
  const WebAnswer answer = web_->Post("SessionService/GetSession", large);
  EXPECT_EQ(answer.status, 413);
  EXPECT_EQ(answer.Code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(answer.Message(), HasSubstr("--max-message-mb"));
  EXPECT_EQ(web_->Post("SessionService/ListSessions", "{}").status, 200);
  // As a message, the numbers take four times as much as in their JSON.
  std::string numbers = R"({"measurements": {"timeS": [0)";
  for (int i = 0; i < 300'000; ++i) numbers += ",1";
  const WebAnswer longer = web_->Post("SessionService/AddMeasurements", numbers + "]}}");
  EXPECT_EQ(longer.status, 413);
  EXPECT_THAT(longer.Message(), HasSubstr("--max-message-mb"));
}

}  // namespace
}  // namespace polyest::internal
