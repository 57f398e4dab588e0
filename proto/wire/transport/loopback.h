#pragma once

// Recognizes addresses that stay on this machine.

#include <string>

namespace polyest::internal {

// Returns true for 127.0.0.0/8, ::1 (in brackets or not) and localhost. Other names, whatever they
// resolve to, and shortened addresses are not taken for loopback.
bool IsLoopback(const std::string& host);

}  // namespace polyest::internal
