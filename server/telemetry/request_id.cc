#include "server/telemetry/request_id.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <random>

namespace polyest::internal {

bool IsRequestId(std::string_view text) {
  constexpr size_t kLongest = 64;
  return !text.empty() && text.size() <= kLongest &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return absl::ascii_isalnum(c) || c == '.' || c == '_' || c == '-';
         });
}

std::string MakeRequestId() {
  // A random number identifies the process, and a counter its calls.
  static const uint32_t process = std::random_device()();
  static std::atomic<uint64_t> calls = 0;
  return absl::StrFormat("%08x-%d", process, ++calls);
}

}  // namespace polyest::internal
