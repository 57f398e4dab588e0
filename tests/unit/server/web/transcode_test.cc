#include "server/web/transcode.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <grpcpp/support/error_details.h>
#include <gtest/gtest.h>

#include "polyest/v1/operation_service.pb.h"
#include "polyest/v1/session_service.pb.h"
#include "proto/wire/refusal/refusal.h"
#include "server/service/status_mapping.h"
#include "server/web/http_status.h"
#include "server/web/web_answers.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;
using ::testing::StartsWith;

template <typename Message>
rpc::Status Read(const std::string& json, Message* message = nullptr) {
  std::string bytes;
  rpc::Status status = FromJsonText(json, *Message::descriptor(), bytes);
  if (status.code() == 0 && message != nullptr) {
    EXPECT_TRUE(message->ParseFromString(bytes));
  }
  return status;
}

TEST(Transcode, ReadsARequestAndTakesNothingForAnEmptyOne) {
  v1::GetSessionRequest request;
  EXPECT_EQ(Read(R"({"name": "sessions/a"})", &request).code(), 0);
  EXPECT_EQ(request.name(), "sessions/a");
  for (const char* json : {"", " \r\n", "{}"}) {
    EXPECT_EQ(Read(json, &request).code(), 0) << json;
    EXPECT_EQ(request.name(), "");
  }
}

TEST(Transcode, TakesAProblemFileAsItIs) {
  v1::CreateSessionRequest request;
  EXPECT_EQ(Read(R"({"session": {"problem": {"expansion": {"order": "AUTO"}}}})", &request).code(),
            0);
  EXPECT_TRUE(request.session().problem().has_expansion());
  EXPECT_FALSE(request.session().problem().expansion().has_order());
}

TEST(Transcode, NamesThePlaceOfASyntaxError) {
  const rpc::Status status = Read<v1::GetSessionRequest>("{\"name\":\n\"sessions/a}");
  EXPECT_EQ(status.code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.message(),
              AllOf(StartsWith("line 2, column 13 of the body: "), HasSubstr("closing quote")));
}

TEST(Transcode, RefusesWhatIsNotQuiteJson) {
  EXPECT_THAT(Read<v1::GetSessionRequest>("{\"name\": \"a\",}").message(),
              AllOf(StartsWith("line 1, column 14 of the body: "),
                    HasSubstr("no comma may follow the last value")));
  EXPECT_THAT(Read<v1::GetSessionRequest>("{name: \"a\"}").message(),
              StartsWith("line 1, column 3 of the body: syntax error"));
}

TEST(Transcode, RefusesALostNumberWithItsField) {
  // Of any length: wrong values of other types are looked for in short texts only.
  const std::string long_text(size_t{2} << 20, 'x');
  for (const std::string& schema : {std::string("s"), long_text}) {
    const rpc::Status status = Read<v1::CreateSessionRequest>(
        R"({"session": {"problem": {"$schema": ")" + schema +
        "\",\n"
        R"("uncertain": [{"uniform": {"lower": null, "upper": 2}}]}}})");
    EXPECT_EQ(status.code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(status.message(),
              "line 2, column 37 of the body: session.problem.uncertain[0].uniform.lower: null "
              "must be a number");
    ASSERT_EQ(status.details_size(), 1);
    rpc::BadRequest details;
    ASSERT_TRUE(details.ParseFromString(status.details(0).value()));
    EXPECT_EQ(details.field_violations(0).field(), "session.problem.uncertain[0].uniform.lower");
    EXPECT_EQ(details.field_violations(0).description(), "null must be a number");
  }
}

TEST(Transcode, NamesEveryUnknownFieldWithWhatMayBeMeant) {
  const rpc::Status status =
      Read<v1::CreateSessionRequest>(R"({"sesion_id": 1, "session": {"problem": {"fxed": {}}}})");
  EXPECT_EQ(status.code(), grpc::StatusCode::INVALID_ARGUMENT);
  ASSERT_EQ(status.details_size(), 1);
  EXPECT_EQ(status.details(0).type_url(), "type.googleapis.com/google.rpc.BadRequest");
  rpc::BadRequest details;
  ASSERT_TRUE(details.ParseFromString(status.details(0).value()));
  ASSERT_EQ(details.field_violations_size(), 2);
  EXPECT_EQ(details.field_violations(0).field(), "sesion_id");
  EXPECT_EQ(details.field_violations(1).field(), "session.problem.fxed");
  EXPECT_THAT(details.field_violations(1).description(), HasSubstr("did you mean \"fixed\"?"));
  EXPECT_THAT(status.message(), HasSubstr("session.problem.fxed: unknown field"));
}

TEST(Transcode, RefusesValuesOfTheWrongTypeAndTextThatIsNoObject) {
  for (const char* json : {R"({"name": 1e400})", R"({"name": {}})", "[]", "1", "nonsense",
                           "{\"name\": \"\xff\"}", R"({"name": "a", "name": )", "{}{}"}) {
    EXPECT_EQ(Read<v1::GetSessionRequest>(json).code(), grpc::StatusCode::INVALID_ARGUMENT) << json;
  }
}

TEST(Transcode, NamesTheBodyThatIsNoObject) {
  EXPECT_EQ(Read<v1::GetSessionRequest>(" [1]").message(), "the body must hold one JSON object");
  EXPECT_EQ(Read<v1::GetSessionRequest>("null").message(), "the body must hold one JSON object");
}

TEST(Transcode, RefusesDeepNestingAtOnce) {
  const std::string deep(100'000, '[');
  const rpc::Status status =
      Read<v1::CreateSessionRequest>(R"({"session": {"problem": {"fixed": {"kt": )" + deep);
  EXPECT_EQ(status.code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.message(),
            "line 1, column 138 of the body: brackets are nested more than 100 deep");
}

TEST(Transcode, RefusesAFieldThatIsGivenTwice) {
  const rpc::Status status = Read<v1::GetSessionRequest>("{\"name\": \"a\",\n\"name\": \"b\"}");
  EXPECT_EQ(status.code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.message(), "line 2, column 1 of the body: name: given twice");
}

TEST(Transcode, WritesWhatTheCommandWrites) {
  v1::WatchSessionResponse response;
  auto& direction = *response.mutable_estimate()->add_directions();
  auto& coefficient = *direction.add_coefficients();
  coefficient.set_parameter("k");
  coefficient.set_value(0.5);
  response.mutable_estimate()->set_sequence(7);
  const std::string json =
      ToJsonText(response.SerializeAsString(), *response.GetDescriptor()).value();
  EXPECT_THAT(json, HasSubstr(R"("sequence":"7")"));
  EXPECT_THAT(json, HasSubstr(R"("coefficients":{"k":0.5})"));
  EXPECT_THAT(json, Not(HasSubstr("\n")));
}

TEST(Transcode, WritesTheDetailsOfAnErrorUnderTheirStandardNames) {
  const grpc::Status status =
      ToGrpc(Refuse(absl::StatusCode::kResourceExhausted, "too many sessions",
                    {.reason = kBusy,
                     .limit = "--max-sessions",
                     .retry_delay = std::chrono::milliseconds(1'500)}));
  const HttpAnswer answer = ErrorAnswer(ToRpcStatus(status));
  EXPECT_EQ(answer.status, 429);
  EXPECT_EQ(answer.content_type, "application/json");
  EXPECT_THAT(answer.headers, Contains(Pair("Retry-After", "2")));
  EXPECT_THAT(answer.body, HasSubstr(R"("code":8,"message":"too many sessions")"));
  EXPECT_THAT(
      answer.body,
      HasSubstr(R"({"@type":"type.googleapis.com/google.rpc.RetryInfo","retryDelay":"1.500s"})"));
  EXPECT_THAT(answer.body, HasSubstr(R"("metadata":{"limit":"--max-sessions"})"));
}

TEST(Transcode, WritesTheErrorOfAnOperation) {
  v1::Operation operation;
  *operation.mutable_error() = ToRpcStatus(
      Refuse(absl::StatusCode::kResourceExhausted, "no time", {.reason = kLimitExceeded}));
  EXPECT_THAT(ToJsonText(operation.SerializeAsString(), *operation.GetDescriptor()).value(),
              HasSubstr(R"("reason":"LIMIT_EXCEEDED")"));
}

TEST(Transcode, RefusesToWriteWhatHasNoFormInJson) {
  v1::Session session;
  session.mutable_create_time()->set_seconds(1'000'000'000'000'000);
  EXPECT_EQ(ToJsonText(session.SerializeAsString(), *session.GetDescriptor()).status().code(),
            absl::StatusCode::kInternal);
  session.Clear();
  session.set_name("a\xed\xa0\x80");  // half of a pair of UTF-16
  EXPECT_EQ(ToJsonText(session.SerializeAsString(), *session.GetDescriptor()).status().code(),
            absl::StatusCode::kInternal);
}

TEST(Transcode, WritesTheCodeOfAnErrorWhoseDetailsAreUnknown) {
  rpc::Status status;
  status.set_code(grpc::StatusCode::NOT_FOUND);
  status.add_details()->set_type_url("type.googleapis.com/nobody.Knows");
  const HttpAnswer answer = ErrorAnswer(status);
  EXPECT_EQ(answer.status, 404);
  EXPECT_THAT(answer.body, HasSubstr(R"("code":5,)"));
}

TEST(HttpStatus, IsThatOfTheTableOfGoogleRpcCode) {
  const std::pair<grpc::StatusCode, int> kTable[] = {{grpc::StatusCode::OK, 200},
                                                     {grpc::StatusCode::CANCELLED, 499},
                                                     {grpc::StatusCode::UNKNOWN, 500},
                                                     {grpc::StatusCode::INVALID_ARGUMENT, 400},
                                                     {grpc::StatusCode::DEADLINE_EXCEEDED, 504},
                                                     {grpc::StatusCode::NOT_FOUND, 404},
                                                     {grpc::StatusCode::ALREADY_EXISTS, 409},
                                                     {grpc::StatusCode::PERMISSION_DENIED, 403},
                                                     {grpc::StatusCode::UNAUTHENTICATED, 401},
                                                     {grpc::StatusCode::RESOURCE_EXHAUSTED, 429},
                                                     {grpc::StatusCode::FAILED_PRECONDITION, 400},
                                                     {grpc::StatusCode::ABORTED, 409},
                                                     {grpc::StatusCode::OUT_OF_RANGE, 400},
                                                     {grpc::StatusCode::UNIMPLEMENTED, 501},
                                                     {grpc::StatusCode::INTERNAL, 500},
                                                     {grpc::StatusCode::UNAVAILABLE, 503},
                                                     {grpc::StatusCode::DATA_LOSS, 500}};
  for (const auto& [code, status] : kTable) EXPECT_EQ(HttpStatus(code), status) << code;
}

}  // namespace
}  // namespace polyest::internal
