#pragma once

#include <string>
#include <string_view>

namespace polyest::internal {

// Of metadata, both ways.
inline constexpr char kRequestIdKey[] = "x-request-id";

// 1 to 64 of A-Z a-z 0-9 . _ -
bool IsRequestId(std::string_view text);

// One that no other call of any daemon is likely to have.
std::string MakeRequestId();

}  // namespace polyest::internal
