#include "server/web/http_message.h"

#include <absl/strings/ascii.h>

#include <algorithm>

namespace polyest::internal {

bool HeaderLess::operator()(const std::string& a, const std::string& b) const {
  return std::lexicographical_compare(
      a.begin(), a.end(), b.begin(), b.end(), [](unsigned char one, unsigned char other) {
        return absl::ascii_tolower(one) < absl::ascii_tolower(other);
      });
}

std::optional<std::string> HttpRequest::Header(const std::string& name) const {
  const auto [first, last] = headers.equal_range(name);
  if (first == last || std::next(first) != last) return std::nullopt;
  return first->second;
}

}  // namespace polyest::internal
