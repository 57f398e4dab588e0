#pragma once

#include <string>

namespace polyest::internal {

// Returns text that another program wrote in a form fit for messages: one line of valid UTF-8, of
// at most `max_bytes` bytes, with '?' for what was not UTF-8.
std::string CleanText(const std::string& text, size_t max_bytes = 1000);

}  // namespace polyest::internal
