#include "server/telemetry/call_interceptor.h"

#include <absl/status/status.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_interceptor.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "server/telemetry/log_limit.h"
#include "server/telemetry/request_id.h"
#include "server/telemetry/structured_log.h"

namespace polyest::internal {
namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerRpcInfo;

constexpr char kPrefix[] = "/polyest.v1.";
// Lines that the log gets of calls of a tenant that ended with one code other than OK: at once, and
// each second.
constexpr int kRefusalBurst = 50;
constexpr double kRefusalsASecond = 5;

std::string CodeName(const grpc::Status& status) {
  // Both libraries number the codes alike.
  return absl::StatusCodeToString(static_cast<absl::StatusCode>(status.error_code()));
}

// Returns the name of the method without its service, because no two services share a name.
std::string MethodName(absl::string_view path) {
  return std::string(path.substr(path.rfind('/') + 1));
}

// Returns the session that a request or a response names; empty if it names none.
std::string SessionNamed(const google::protobuf::Message& message) {
  for (const char* name : {"session", "name"}) {
    const auto* field = message.GetDescriptor()->FindFieldByName(name);
    if (field == nullptr || field->is_repeated() ||
        field->type() != google::protobuf::FieldDescriptor::TYPE_STRING) {
      continue;
    }
    std::string value = message.GetReflection()->GetString(message, field);
    if (absl::StartsWith(value, "sessions/")) return value;
  }
  const auto* subject = message.GetDescriptor()->FindFieldByName("subject");
  if (subject == nullptr || subject->message_type() == nullptr) return "";
  return SessionNamed(message.GetReflection()->GetMessage(message, subject));
}

spdlog::level::level_enum LevelOf(grpc::StatusCode code, bool changes_sessions) {
  switch (code) {
    case grpc::StatusCode::OK:
      return changes_sessions ? spdlog::level::info : spdlog::level::debug;
    case grpc::StatusCode::CANCELLED:
      return spdlog::level::debug;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::UNAUTHENTICATED:
    case grpc::StatusCode::PERMISSION_DENIED:
      return spdlog::level::warn;
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::DATA_LOSS:
    case grpc::StatusCode::UNKNOWN:
      return spdlog::level::err;
    default:
      return spdlog::level::info;
  }
}

// Returns whether the reason of a refusal may be logged. Reasons with these codes speak of the
// daemon; others repeat the request.
bool MayTellReason(grpc::StatusCode code) {
  return code == grpc::StatusCode::RESOURCE_EXHAUSTED || code == grpc::StatusCode::UNAVAILABLE ||
         code == grpc::StatusCode::INTERNAL || code == grpc::StatusCode::DATA_LOSS ||
         code == grpc::StatusCode::UNAUTHENTICATED || code == grpc::StatusCode::PERMISSION_DENIED;
}

// Returns whether the audit log has a call.
bool IsAudited(absl::string_view method, grpc::StatusCode code) {
  return code == grpc::StatusCode::UNAUTHENTICATED || code == grpc::StatusCode::PERMISSION_DENIED ||
         method == "CreateSession" || method == "DeleteSession" || method == "ImportSession" ||
         method == "ExportSession" || method == "DownloadBackup";
}

// Is shared by all calls of a server.
struct Observers {
  Metrics& metrics;
  AuditLog* audit;  // null without one
  const CallerOf caller_of;
  LogLimit refusals{kRefusalBurst, kRefusalsASecond};
  LogLimit audited_refusals{kRefusalBurst, kRefusalsASecond};
};

class CallInterceptor final : public grpc::experimental::Interceptor {
 public:
  CallInterceptor(ServerRpcInfo& call, Observers& observers)
      : call_(call), observers_(observers), method_(MethodName(call.method())) {}

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      ChooseId(*methods->GetRecvInitialMetadata());
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_MESSAGE)) {
      NoteSession(methods->GetRecvMessage());
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      methods->GetSendInitialMetadata()->emplace(kRequestIdKey, id_);
    }
    // The response is read only where it ends the call, because a stream writes while it reads.
    if (one_response_ &&
        methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_MESSAGE)) {
      NoteSession(methods->GetSendMessage());
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      OnEnd(methods->GetSendStatus());
    }
    methods->Proceed();
  }

 private:
  using Clock = std::chrono::steady_clock;

  // Leaves the id in the metadata, from which it is passed on to other daemons.
  void ChooseId(std::multimap<grpc::string_ref, grpc::string_ref>& metadata) {
    const auto given = metadata.find(kRequestIdKey);
    if (given != metadata.end()) id_.assign(given->second.data(), given->second.size());
    if (!IsRequestId(id_)) id_ = MakeRequestId();
    metadata.erase(kRequestIdKey);
    metadata.emplace(kRequestIdKey, id_);
  }

  // Notes the session that a message names. Every message of the services is a protobuf message; it
  // is null when the stream has ended.
  void NoteSession(const void* message) {
    if (message == nullptr) return;
    const std::lock_guard lock(mutex_);
    if (!session_.empty()) return;
    session_ = SessionNamed(*static_cast<const google::protobuf::Message*>(message));
  }

  std::string Session() const {
    const std::lock_guard lock(mutex_);
    return session_;
  }

  void OnEnd(const grpc::Status& status) {
    const std::chrono::duration<double> duration = Clock::now() - begin_;
    const bool unary = call_.type() == ServerRpcInfo::Type::UNARY;
    observers_.metrics.Count(Metrics::Call{method_, CodeName(status), unary, duration.count()});
    const bool changes_sessions =
        method_ == "CreateSession" || method_ == "DeleteSession" || method_ == "ImportSession";
    const auto level = LevelOf(status.error_code(), changes_sessions);
    const bool audited = observers_.audit != nullptr && IsAudited(method_, status.error_code());
    if (!audited && !IsLogged(level)) return;
    const LoggedCaller caller = observers_.caller_of(*call_.server_context());
    if (audited) Audit(status, caller);
    if (!IsLogged(level)) return;
    const auto suppressed = Admit(observers_.refusals, status, caller);
    if (!suppressed) return;
    LogFields fields = Described(status, caller);
    fields.emplace_back("duration_s", absl::StrFormat("%.6f", duration.count()));
    fields.emplace_back("reason", MayTellReason(status.error_code()) ? status.error_message() : "");
    fields.emplace_back("suppressed", *suppressed);
    Log(level, "call", fields);
  }

  // Returns whether a line about a call may be written, and if so, how many were not before; empty
  // for none. Strangers share one limit, and so do the callers of each tenant.
  static std::optional<std::string> Admit(LogLimit& limit, const grpc::Status& status,
                                          const LoggedCaller& caller) {
    if (status.ok()) return "";
    const auto suppressed = limit.Admit(absl::StrCat(CodeName(status), " ", caller.tenant));
    if (!suppressed) return std::nullopt;
    return SuppressedText(*suppressed);
  }

  LogFields Described(const grpc::Status& status, const LoggedCaller& caller) const {
    return {{"request", id_},          {"method", method_},     {"session", Session()},
            {"tenant", caller.tenant}, {"caller", caller.name}, {"peer", caller.peer},
            {"code", CodeName(status)}};
  }

  void Audit(const grpc::Status& status, const LoggedCaller& caller) const {
    const auto suppressed = Admit(observers_.audited_refusals, status, caller);
    if (!suppressed) return;
    LogFields fields = Described(status, caller);
    fields.emplace_back("role", caller.role);
    // The reasons of these two speak of the caller's role only.
    const bool refused = status.error_code() == grpc::StatusCode::UNAUTHENTICATED ||
                         status.error_code() == grpc::StatusCode::PERMISSION_DENIED;
    fields.emplace_back("reason", refused ? status.error_message() : "");
    fields.emplace_back("suppressed", *suppressed);
    observers_.audit->Add("call", fields);
  }

  ServerRpcInfo& call_;
  Observers& observers_;
  const std::string method_;
  const bool one_response_ = call_.type() == ServerRpcInfo::Type::UNARY ||
                             call_.type() == ServerRpcInfo::Type::CLIENT_STREAMING;
  const Clock::time_point begin_ = Clock::now();
  std::string id_;
  // A stream may end on one thread while its first message arrives on another.
  mutable std::mutex mutex_;
  std::string session_;
};

class CallInterceptors final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  CallInterceptors(Metrics& metrics, AuditLog* audit, CallerOf caller_of)
      : observers_{.metrics = metrics, .audit = audit, .caller_of = std::move(caller_of)} {}

  // Returns null for calls of health and reflection, whose messages are of other kinds.
  grpc::experimental::Interceptor* CreateServerInterceptor(ServerRpcInfo* call) override {
    if (!absl::StartsWith(call->method(), kPrefix)) return nullptr;
    return new CallInterceptor(*call, observers_);
  }

 private:
  Observers observers_;
};

}  // namespace

void ObserveCalls(grpc::ServerBuilder& builder, Metrics& metrics, AuditLog* audit,
                  CallerOf caller_of) {
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> creators;
  creators.push_back(std::make_unique<CallInterceptors>(metrics, audit, std::move(caller_of)));
  builder.experimental().SetInterceptorCreators(std::move(creators));
}

}  // namespace polyest::internal
