#include "client/cli/exit_status.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>

#include <optional>
#include <string>
#include <utility>

#include "core/common/field_error.h"

namespace polyest::internal {
namespace {

// The options of commands that fill fields of requests, by the fields' names in JSON.
constexpr std::pair<absl::string_view, absl::string_view> kOptions[] = {
    {"drawCount", "--draws"},   {"forecastS", "--forecast"}, {"highest", "--highest"},
    {"horizonS", "--horizon"},  {"joints", "--joint"},       {"lowest", "--lowest"},
    {"maxRowCount", "--rows"},  {"outputs", "--outputs"},    {"parameters", "--parameter"},
    {"pointCount", "--points"}, {"possible", "--outputs"},   {"probabilities", "--quantiles"},
    {"sessionId", "--session"}, {"smoothed", "--smoothed"},  {"sampleCount", "--samples"},
    {"stepS", "--step"},        {"untilS", "--until"},
};

// Returns the message of a status, which names the option in place of the field that it fills.
std::string MessageOf(const absl::Status& status) {
  // The words of gRPC and of the core do not name the option, without which no command gives up.
  if (absl::IsDeadlineExceeded(status)) return "there is no answer within the --deadline";
  const std::optional<FieldPath> field = FieldOf(status);
  for (const auto& [name, option] : kOptions) {
    if (!field || field->empty() || field->steps().front().text() != name) continue;
    return absl::StrCat(option, ": ", SentenceOf(status));
  }
  return std::string(status.message());
}

}  // namespace

ExitStatus ExitStatusOf(const absl::Status& status, absl::string_view server) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return kExitOk;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kOutOfRange:
      return kExitBadInput;
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kResourceExhausted:
      return server.empty() ? kExitBadInput : kExitServer;
    case absl::StatusCode::kAborted:
    case absl::StatusCode::kDataLoss:
    case absl::StatusCode::kUnimplemented:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kUnauthenticated:
      return kExitServer;
    case absl::StatusCode::kUnavailable:
    case absl::StatusCode::kDeadlineExceeded:
      return server.empty() ? kExitFailure : kExitServer;
    default:
      return kExitFailure;
  }
}

int Report(const absl::Status& status, absl::string_view server, std::ostream& err) {
  const ExitStatus exit_status = ExitStatusOf(status, server);
  std::string message = absl::StrReplaceAll(MessageOf(status), {{"\r", ""}, {"\n", " "}});
  if (message.empty()) message = absl::StatusCodeToString(status.code());
  if (exit_status == kExitServer) message = absl::StrCat("server ", server, ": ", message);
  err << "polyest: " << message << std::endl;
  return exit_status;
}

}  // namespace polyest::internal
