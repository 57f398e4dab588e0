#include "server/web/umbridge_gateway.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <utility>
#include <vector>

#include "polyest/v1/session_service.pb.h"
#include "server/security/method_roles.h"
#include "server/service/status_mapping.h"
#include "server/web/call_metadata.h"
#include "server/web/transcode.h"
#include "server/web/umbridge_message.h"
#include "server/web/web_answers.h"
#include "server/web/web_call.h"

namespace polyest::internal {
namespace {

using UmStatus = grpc::StatusCode;

constexpr char kSessions[] = "sessions/";
constexpr char kPathOfInfo[] = "/Info";
constexpr int kPageOfSessions = 200;
// Longest request: one point and a direction.
constexpr size_t kMaxBody = size_t{1} << 20;

// Returns the protocol's type of an error.
std::string_view TypeOf(int code) {
  switch (static_cast<UmStatus>(code)) {
    case UmStatus::NOT_FOUND:
      return "ModelNotFound";
    case UmStatus::INVALID_ARGUMENT:
    case UmStatus::OUT_OF_RANGE:
      return "InvalidInput";
    case UmStatus::UNIMPLEMENTED:
      return "UnsupportedFeature";
    case UmStatus::UNAUTHENTICATED:
      return "Unauthenticated";
    case UmStatus::PERMISSION_DENIED:
      return "PermissionDenied";
    case UmStatus::RESOURCE_EXHAUSTED:
    case UmStatus::UNAVAILABLE:
      return "Unavailable";
    default:
      return "EvaluationFailed";
  }
}

// Returns the answer for an error: as of the other HTTP port, with the protocol's body.
HttpAnswer UmError(const rpc::Status& status) {
  HttpAnswer answer = ErrorAnswer(status);
  absl::string_view message = status.message();
  const bool of_point = absl::ConsumePrefix(&message, "values: ");
  answer.body = UmBridgeError(TypeOf(status.code()),
                              of_point ? absl::StrCat("input: ", message) : std::string(message));
  return Secured(std::move(answer));
}

HttpAnswer UmError(const absl::Status& status) { return UmError(ToRpcStatus(status)); }

HttpAnswer UmAnswer(std::string body) {
  HttpAnswer answer{.content_type = "application/json"};
  answer.body = std::move(body);
  return Secured(std::move(answer));
}

}  // namespace

HttpAnswer UmBridgeGateway::Refusal(int status, std::string_view why) const {
  HttpAnswer answer = ErrorAnswer(status, UmStatus::INVALID_ARGUMENT, why);
  answer.body = UmBridgeError("InvalidRequest", why);
  return Secured(std::move(answer));
}

std::optional<HttpAnswer> UmBridgeGateway::AnswerHead(const HttpRequest& request) const {
  const absl::Status host = hosts_.Check(request);
  if (!host.ok()) return UmError(host);
  const bool info = request.path == kPathOfInfo;
  if (!info && !IsUmBridgePath(request.path)) {
    return Refusal(404, "UM-Bridge has no such path; its protocol 1.0 has /Info, /Evaluate …");
  }
  // Clients ask for the list by GET, whatever else the documentation of the protocol says.
  if (request.method != "POST" && !(info && request.method == "GET")) {
    HttpAnswer refusal = Refusal(405, "the requests of UM-Bridge about a model are posted");
    refusal.headers.emplace_back("Allow", info ? "GET, POST" : "POST");
    return refusal;
  }
  // The list that they get is a refusal, logged and counted as any call of theirs.
  if (!options_.who(request)) return AnswerInfo(request);
  return std::nullopt;
}

HttpAnswer UmBridgeGateway::Answer(const HttpRequest& request, const std::string& body) const {
  return request.path == kPathOfInfo ? AnswerInfo(request) : AnswerModel(request, body);
}

template <typename Request, typename Response>
std::optional<HttpAnswer> UmBridgeGateway::Call(const std::string& method, const Request& message,
                                                const HttpRequest& request,
                                                Response& response) const {
  WebCall::Request sent{.method = method};
  const absl::Status set = SetMetadata(request, sent);
  if (!set.ok()) return UmError(set);
  sent.message = message.SerializeAsString();
  WebCall call(channel_, sent);
  std::string answer;
  const std::optional<grpc::Status> status = call.AwaitOnly(request.client, answer);
  if (!status) return Refusal(499, "the client has closed the connection");
  if (!status->ok()) return UmError(ToRpcStatus(*status));
  if (!response.ParseFromString(answer)) {
    return UmError(absl::InternalError("the daemon's answer has a text that is not valid UTF-8"));
  }
  return std::nullopt;
}

HttpAnswer UmBridgeGateway::AnswerInfo(const HttpRequest& request) const {
  std::vector<std::string> models;
  v1::ListSessionsRequest page;
  page.set_page_size(kPageOfSessions);
  do {
    v1::ListSessionsResponse sessions;
    std::optional<HttpAnswer> failed = Call(PathOf("ListSessions"), page, request, sessions);
    if (failed) return *std::move(failed);
    for (const v1::Session& session : sessions.sessions()) {
      models.emplace_back(absl::StripPrefix(session.name(), kSessions));
    }
    page.set_page_token(sessions.next_page_token());
  } while (!page.page_token().empty());
  return UmAnswer(UmBridgeInfo(models));
}

HttpAnswer UmBridgeGateway::AnswerModel(const HttpRequest& request, const std::string& body) const {
  if (body.size() > kMaxBody) return Refusal(413, "the request has more than 1 MiB");
  const auto read = ReadUmBridgeRequest(request.path, body);
  if (!read.ok()) return UmError(read.status());
  v1::ComputeLogDensityRequest asked;
  asked.mutable_subject()->set_session(absl::StrCat(kSessions, read->model));
  asked.mutable_values()->Add(read->input.begin(), read->input.end());
  asked.set_derivative_order(read->DerivativeOrder());
  v1::ComputeLogDensityResponse density;
  std::optional<HttpAnswer> failed = Call(PathOf("ComputeLogDensity"), asked, request, density);
  if (failed) return *std::move(failed);
  auto answer = UmBridgeAnswer(*read, density);
  return answer.ok() ? UmAnswer(*std::move(answer)) : UmError(answer.status());
}

}  // namespace polyest::internal
