#pragma once

#include <string>
#include <string_view>

namespace polyest::internal {

// Names the request id in the metadata of requests and responses.
inline constexpr char kRequestIdKey[] = "x-request-id";

// Returns whether a text may be a request id: 1 to 64 of A-Z a-z 0-9 . _ -
bool IsRequestId(std::string_view text);

// Returns an id that no other call of any daemon is likely to have.
std::string MakeRequestId();

}  // namespace polyest::internal
