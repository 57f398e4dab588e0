#include "server/web/gateway.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <utility>

#include "proto/wire/refusal/refusal.h"
#include "server/security/method_roles.h"
#include "server/service/open_calls.h"
#include "server/service/status_mapping.h"
#include "server/telemetry/request_id.h"
#include "server/telemetry/structured_log.h"
#include "server/web/call_metadata.h"
#include "server/web/http_status.h"
#include "server/web/transcode.h"
#include "server/web/wake_up.h"
#include "server/web/web_answers.h"

namespace polyest::internal {
namespace {

using grpc::StatusCode;
using Clock = WebCall::Clock;

constexpr char kJson[] = "application/json";
constexpr char kEvents[] = "text/event-stream";
constexpr size_t kLargeRequest = size_t{1} << 20;
// Time that a stream has to fail under the status of HTTP rather than by an event.
constexpr std::chrono::milliseconds kFirstEvent{500};

bool IsJson(absl::string_view content_type) {
  const absl::string_view type = content_type.substr(0, content_type.find(';'));
  return absl::EqualsIgnoreCase(absl::StripAsciiWhitespace(type), kJson);
}

// Returns what to do instead of a call whose client sends a stream, which HTTP/1.1 cannot.
std::string Instead(const std::string& method) {
  if (method == "ImportSession") {
    return "ImportSession takes a stream, which needs gRPC: use polyest import";
  }
  return absl::StrCat(method, " takes a stream, which needs gRPC: send batches by AddMeasurements");
}

// Returns another call of the same client.
WebCall::Request CallFor(const WebCall::Request& client, std::string method, std::string message) {
  return {.method = std::move(method), .metadata = client.metadata, .message = std::move(message)};
}

std::string Event(absl::string_view name, absl::string_view data) {
  return absl::StrCat("event: ", name, "\ndata: ", data, "\n\n");
}

HttpAnswer ClientGone() {
  return ErrorAnswer(499, StatusCode::CANCELLED, "the client has closed the connection");
}

}  // namespace

Gateway::Gateway(std::shared_ptr<grpc::Channel> channel, MethodTable methods, HostCheck hosts,
                 Options options)
    : channel_(std::move(channel)),
      methods_(std::move(methods)),
      hosts_(std::move(hosts)),
      options_(std::move(options)),
      watches_(channel_) {}

HttpAnswer Gateway::Refusal(int status, std::string_view why) const {
  return Secured(ErrorAnswer(status, CodeOfRefusal(status), why));
}

std::optional<HttpAnswer> Gateway::AnswerHead(const HttpRequest& request) const {
  const absl::Status host = hosts_.Check(request);
  if (!host.ok()) {
    LogRefusal(request, host);
    return Secured(ErrorAnswer(ToRpcStatus(host)));
  }
  const WebMethod* const method = methods_.Find(request.path);
  const bool reads = request.method == "GET" || request.method == "HEAD";
  if (method == nullptr) {
    if (request.path.starts_with("/v1/")) {
      return Refusal(404, "there is no such method; the path is /v1/Service/Method");
    }
    if (reads) return std::nullopt;
    HttpAnswer refusal = Refusal(405, "files can only be read");
    refusal.headers.emplace_back("Allow", "GET, HEAD");
    return refusal;
  }
  if (request.method != "POST") {
    HttpAnswer refusal = Refusal(405, "methods are called by POST");
    refusal.headers.emplace_back("Allow", "POST");
    return refusal;
  }
  if (!IsJson(request.Header("Content-Type").value_or(""))) {
    return Refusal(415, "the request needs Content-Type: application/json");
  }
  if (method->method->client_streaming()) {
    return Refusal(501, Instead(method->method->name()));
  }
  // The call without its body is refused, logged and counted as any call of theirs.
  if (!options_.who(request)) return Secured(AnswerCall(*method, request, ""));
  return std::nullopt;
}

void Gateway::LogRefusal(const HttpRequest& request, const absl::Status& refusal) const {
  const std::optional<int64_t> suppressed = refusals_.Admit("");
  if (!suppressed) return;
  Log(spdlog::level::warn, "refused over HTTP",
      {{"peer", request.peer},
       {"reason", std::string(refusal.message())},
       {"suppressed", SuppressedText(*suppressed)}});
}

HttpAnswer Gateway::Answer(const HttpRequest& request, const std::string& body) const {
  const WebMethod* const method = methods_.Find(request.path);
  return Secured(method == nullptr ? FileAnswer(options_.files, request.path)
                                   : AnswerCall(*method, request, body));
}

HttpAnswer Gateway::AnswerCall(const WebMethod& method, const HttpRequest& request,
                               const std::string& body) const {
  WebCall::Request call{.method = method.rpc_path};
  const absl::Status set = SetMetadata(request, call);
  if (!set.ok()) return ErrorAnswer(ToRpcStatus(set));
  std::optional<HttpAnswer> refusal = Read(method, request, body, call.message);
  if (refusal) return *std::move(refusal);
  if (!method.method->server_streaming()) {
    WebCall once(channel_, call);
    return AnswerOnce(once, method, request);
  }
  Place place = TakePlace();
  if (place == nullptr) {
    return ErrorAnswer(
        ToRpcStatus(Refuse(absl::StatusCode::kResourceExhausted,
                           absl::StrCat("the daemon serves at most ", options_.streams,
                                        " streams over HTTP at a time"),
                           {.reason = kBusy, .retry_delay = std::chrono::seconds(1)})));
  }
  return AnswerEvents(Begin(method, request, call), request, std::move(place));
}

std::shared_ptr<EventSource> Gateway::Begin(const WebMethod& method, const HttpRequest& request,
                                            const WebCall::Request& call) const {
  // A time limit or the id of a request belongs to one client.
  const bool shared =
      method.rpc_path == PathOf("WatchSession") && !call.timeout && !request.Header(kRequestIdKey);
  const std::optional<Caller> caller = shared ? options_.who(request) : std::nullopt;
  if (!caller) return std::make_shared<CallEvents>(channel_, call, *method.method->output_type());
  SharedWatches::Key key = {call.message, caller->tenant, caller->name, RoleName(caller->role),
                            request.certificate_name};
  const auto [first, last] = request.headers.equal_range("Authorization");
  for (auto header = first; header != last; ++header) key.push_back(header->second);
  if (!watches_.IsOpen(key)) return watches_.Join(key, call);
  // The estimate with which a watch of one's own would begin may still have to be made. It comes to
  // all who watch the session.
  const std::optional<v1::Session> session = SessionOf(request, call);
  if (!session) return std::make_shared<CallEvents>(channel_, call, *method.method->output_type());
  std::shared_ptr<WatchEvents> events = watches_.Join(key, call);
  if (session->sample_count() > 0) {
    v1::GetEstimateRequest present;
    present.set_session(session->name());
    events->Keep(std::make_unique<WebCall>(
        channel_, CallFor(call, PathOf("GetEstimate"), present.SerializeAsString())));
  }
  return events;
}

std::optional<v1::Session> Gateway::SessionOf(const HttpRequest& request,
                                              const WebCall::Request& watch) const {
  v1::WatchSessionRequest watched;
  if (!watched.ParseFromString(watch.message)) return std::nullopt;
  v1::GetSessionRequest get;
  get.set_name(watched.session());
  get.set_omit_problem(true);
  WebCall call(channel_, CallFor(watch, PathOf("GetSession"), get.SerializeAsString()));
  std::string bytes;
  const std::optional<grpc::Status> status = call.AwaitOnly(request.client, bytes);
  v1::Session session;
  if (!status || !status->ok() || !session.ParseFromString(bytes)) return std::nullopt;
  return session;
}

std::optional<HttpAnswer> Gateway::Read(const WebMethod& method, const HttpRequest& request,
                                        const std::string& body, std::string& message) const {
  std::unique_ptr<Turns::Turn> turn;
  if (body.size() > kLargeRequest) {
    const std::string host = request.peer.substr(0, request.peer.rfind(':'));
    turn = large_requests_.Take(request.Header("Authorization").value_or(host));
    if (turn == nullptr) return ErrorAnswer(ToRpcStatus(ShuttingDown()));
    if (WakeUp::IsGone(request.client)) return ClientGone();
  }
  const rpc::Status read = FromJsonText(body, *method.method->input_type(), message);
  if (read.code() != StatusCode::OK) return ErrorAnswer(read);
  if (message.size() <= options_.message_bytes) return std::nullopt;
  message = std::string();
  return ErrorAnswer(413, StatusCode::RESOURCE_EXHAUSTED,
                     absl::StrCat("the message has more than ", options_.message_bytes >> 20,
                                  " MiB (--max-message-mb)"));
}

HttpAnswer Gateway::AnswerOnce(WebCall& call, const WebMethod& method,
                               const HttpRequest& request) const {
  std::string message;
  const std::optional<grpc::Status> status = call.AwaitOnly(request.client, message);
  if (!status) {
    return ClientGone();
  }
  HttpAnswer answer{.content_type = kJson};
  if (status->ok()) {
    auto json = ToJsonText(message, *method.method->output_type());
    if (json.ok()) {
      answer.body = *std::move(json);
    } else {
      answer = ErrorAnswer(ToRpcStatus(json.status()));
    }
  } else {
    answer = ErrorAnswer(ToRpcStatus(*status));
  }
  if (const std::string id = call.request_id(); !id.empty()) {
    answer.headers.emplace_back(kRequestIdKey, id);
  }
  return answer;
}

HttpAnswer Gateway::AnswerEvents(std::shared_ptr<EventSource> source, const HttpRequest& request,
                                 Place place) const {
  const WebCall::Event event = source->Await(request.client, Clock::now() + kFirstEvent);
  if (event == WebCall::Event::kEnd && !source->status().ok()) {
    return ErrorAnswer(ToRpcStatus(source->status()));
  }
  HttpAnswer answer{.content_type = kEvents};
  answer.events = [this, source = std::move(source), event, client = request.client,
                   place = std::move(place)](const HttpAnswer::Send& send) {
    SendEvents(*source, event, client, send);
  };
  return answer;
}

void Gateway::SendEvents(EventSource& source, WebCall::Event event, int client,
                         const HttpAnswer::Send& send) const {
  bool sent = true;
  while (sent) {
    switch (event) {
      case WebCall::Event::kMessage:
        sent = send(*source.Take());
        break;
      case WebCall::Event::kTimeout:
        sent = send(": alive\n\n");
        break;
      case WebCall::Event::kEnd: {
        const grpc::Status status = source.status();
        send(status.ok() ? Event("end", "{}")
                         : Event("error", ErrorAnswer(ToRpcStatus(status)).body));
        return;
      }
      case WebCall::Event::kClientGone:
        return;
    }
    if (sent) event = source.Await(client, Clock::now() + options_.alive);
  }
}

Gateway::Place Gateway::TakePlace() const {
  if (++streams_ > options_.streams) {
    --streams_;
    return nullptr;
  }
  return {this, [](const Gateway* gateway) { --gateway->streams_; }};
}

}  // namespace polyest::internal
