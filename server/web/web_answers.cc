#include "server/web/web_answers.h"

#include <grpcpp/support/status_code_enum.h>

#include <algorithm>
#include <utility>

#include "proto/wire/json/json_format.h"
#include "server/web/http_status.h"

namespace polyest::internal {
namespace {

constexpr std::pair<const char*, const char*> kHeaders[] = {
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
     "connect-src 'self'; font-src 'self'; base-uri 'none'; frame-ancestors 'none'; "
     "form-action 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
};
constexpr char kCacheControl[] = "Cache-Control";

// Returns the seconds after which to try again, rounded up; 0: the status does not say.
int64_t RetryDelay(const rpc::Status& status) {
  for (const google::protobuf::Any& detail : status.details()) {
    rpc::RetryInfo retry;
    if (detail.type_url().ends_with(".RetryInfo") && retry.ParseFromString(detail.value())) {
      return retry.retry_delay().seconds() + (retry.retry_delay().nanos() > 0 ? 1 : 0);
    }
  }
  return 0;
}

}  // namespace

HttpAnswer ErrorAnswer(const rpc::Status& status) {
  const auto code = static_cast<grpc::StatusCode>(status.code());
  HttpAnswer answer{.status = HttpStatus(code), .content_type = "application/json"};
  auto json = TryToJson(status, /*several_lines=*/false);
  // Keeps only the code of an error that has no form in JSON.
  if (!json.ok()) return ErrorAnswer(answer.status, code, "the error has no form in JSON");
  answer.body = *std::move(json);
  if (code == grpc::StatusCode::UNAUTHENTICATED) {
    answer.headers.emplace_back("WWW-Authenticate", "Bearer");
  }
  if (const int64_t delay = RetryDelay(status); delay > 0) {
    answer.headers.emplace_back("Retry-After", std::to_string(delay));
  }
  return answer;
}

HttpAnswer ErrorAnswer(int http_status, int code, std::string_view message) {
  rpc::Status status;
  status.set_code(code);
  status.set_message(std::string(message));
  HttpAnswer answer = ErrorAnswer(status);
  answer.status = http_status;
  return answer;
}

HttpAnswer Secured(HttpAnswer answer) {
  for (const auto& [name, value] : kHeaders) answer.headers.emplace_back(name, value);
  if (std::ranges::none_of(answer.headers,
                           [](const auto& header) { return header.first == kCacheControl; })) {
    answer.headers.emplace_back(kCacheControl, "no-store");
  }
  return answer;
}

}  // namespace polyest::internal
