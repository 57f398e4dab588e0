#pragma once

#include <chrono>

namespace polyest::internal {

// Calls the health service over a connected socket as an HTTP/2 client does. Returns whether any
// answer to the call comes before the deadline.
bool AnswersHealthCall(int socket, std::chrono::steady_clock::time_point deadline);

}  // namespace polyest::internal
