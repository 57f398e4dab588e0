#include "server/web/call_metadata.h"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "server/security/in_process_caller.h"
#include "server/telemetry/request_id.h"

namespace polyest::internal {
namespace {

constexpr char kAuthorization[] = "authorization";
constexpr char kTimeout[] = "grpc-timeout";

}  // namespace

absl::StatusOr<std::chrono::microseconds> ParseTimeout(std::string_view text) {
  constexpr size_t kMaxDigits = 8;
  const absl::Status refusal = absl::InvalidArgumentError(
      "Grpc-Timeout must be 1 to 8 digits and a unit: H, M, S, m, u or n, as in 30S");
  int64_t count = 0;
  if (text.size() < 2 || text.size() > kMaxDigits + 1 ||
      !std::all_of(text.begin(), text.end() - 1, absl::ascii_isdigit) ||
      !absl::SimpleAtoi(absl::string_view(text.data(), text.size() - 1), &count)) {
    return refusal;
  }
  switch (text.back()) {
    case 'H':
      return std::chrono::hours(count);
    case 'M':
      return std::chrono::minutes(count);
    case 'S':
      return std::chrono::seconds(count);
    case 'm':
      return std::chrono::milliseconds(count);
    case 'u':
      return std::chrono::microseconds(count);
    case 'n':
      return std::chrono::ceil<std::chrono::microseconds>(std::chrono::nanoseconds(count));
    default:
      return refusal;
  }
}

absl::Status SetMetadata(const HttpRequest& request, WebCall::Request& call) {
  // Two of them are passed on, too: whoever is asked for a token refuses such a call.
  const auto [first, last] = request.headers.equal_range(kAuthorization);
  for (auto header = first; header != last; ++header) {
    // gRPC ends the process when it is given others.
    if (!std::ranges::all_of(header->second, absl::ascii_isprint)) {
      return absl::InvalidArgumentError("Authorization has characters other than those of ASCII");
    }
    call.metadata.emplace_back(kAuthorization, header->second);
  }
  const std::string id = request.Header(kRequestIdKey).value_or("");
  if (IsRequestId(id)) call.metadata.emplace_back(kRequestIdKey, id);
  for (auto& entry : MetadataOf({request.peer, request.certificate_name})) {
    call.metadata.push_back(std::move(entry));
  }
  if (request.headers.count(kTimeout) > 0) {
    POLYEST_ASSIGN_OR_RETURN(call.timeout, ParseTimeout(request.Header(kTimeout).value_or("")));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
