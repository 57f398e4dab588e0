#include "server/telemetry/library_log.h"

#include <absl/strings/match.h>
#include <absl/strings/strip.h>
#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdlib>
#include <mutex>

#include "server/telemetry/structured_log.h"

namespace polyest::internal {
namespace {

// gRPC 1.51 begins the message with the first of these, and its details for developers with the
// second.
constexpr char kHandshakeFailed[] = "Handshaking failed: ";
constexpr char kDetails[] = " {";
// Shortest time between two warnings, because peers may try again as often as they like.
constexpr std::chrono::seconds kBetweenWarnings{1};

void WarnOfHandshake(const std::string& why) {
  static std::mutex mutex;
  static std::chrono::steady_clock::time_point next;
  const auto now = std::chrono::steady_clock::now();
  {
    const std::lock_guard lock(mutex);
    if (now < next) return;
    next = now + kBetweenWarnings;
  }
  Log(spdlog::level::warn,
      "a connection failed in its TLS handshake: the client may speak without TLS (it needs "
      "--tls-ca), have no certificate that is known here, or not trust this daemon's",
      {{"reason", why}});
}

bool verbose = false;

void OnMessage(gpr_log_func_args* arguments) {
  if (const std::string why = FailedHandshake(arguments->message); !why.empty()) {
    return WarnOfHandshake(why);
  }
  if (verbose || arguments->severity == GPR_LOG_SEVERITY_ERROR) {
    spdlog::debug("grpc: {}", arguments->message);
  }
}

}  // namespace

std::string FailedHandshake(absl::string_view message) {
  if (!absl::ConsumePrefix(&message, kHandshakeFailed)) return "";
  return std::string(message.substr(0, message.find(kDetails)));
}

void StartLibraryLog() {
  gpr_set_log_function(OnMessage);
  verbose = std::getenv("GRPC_VERBOSITY") != nullptr;
  // gRPC reports handshakes at this level only.
  gpr_set_log_verbosity(GPR_LOG_SEVERITY_DEBUG);
  google::protobuf::SetLogHandler(
      [](google::protobuf::LogLevel level, const char*, int, const std::string& message) {
        const bool ends = level == google::protobuf::LOGLEVEL_FATAL;
        spdlog::log(ends ? spdlog::level::critical : spdlog::level::debug, "protobuf: {}", message);
      });
}

}  // namespace polyest::internal
