#pragma once

// Tells gRPC what the head of an HTTP request says about its call.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <string_view>

#include "server/web/http_message.h"
#include "server/web/web_call.h"

namespace polyest::internal {

// Sets the metadata and the time limit of a call from the headers Authorization, X-Request-Id and
// Grpc-Timeout, and from the client's address and certificate. INVALID_ARGUMENT for a header that
// cannot be passed on.
absl::Status SetMetadata(const HttpRequest& request, WebCall::Request& call);

// Returns the time that a value of Grpc-Timeout means: 1 to 8 digits and a unit, one of H, M, S, m,
// u, n. INVALID_ARGUMENT for anything else.
absl::StatusOr<std::chrono::microseconds> ParseTimeout(std::string_view text);

}  // namespace polyest::internal
