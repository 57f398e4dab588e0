#pragma once

#include <string>

namespace polyest::internal {

// Text that an FMU brought along, fit for messages: one line of valid UTF-8, at most so many bytes.
std::string CleanText(const std::string& text, size_t max_bytes = 1000);

}  // namespace polyest::internal
