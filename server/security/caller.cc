#include "server/security/caller.h"

#include <absl/strings/ascii.h>

#include <algorithm>

namespace polyest::internal {

std::string RoleName(Role role) {
  switch (role) {
    case Role::kReader:
      return "reader";
    case Role::kWriter:
      return "writer";
    case Role::kAdmin:
      return "admin";
    case Role::kOperator:
      return "operator";
  }
  return "";
}

std::optional<Role> ParseRole(absl::string_view name) {
  for (const Role role : {Role::kReader, Role::kWriter, Role::kAdmin, Role::kOperator}) {
    if (name == RoleName(role)) return role;
  }
  return std::nullopt;
}

bool IsCallerWord(absl::string_view word) {
  constexpr size_t kLongest = 64;
  return !word.empty() && word.size() <= kLongest &&
         absl::ascii_isalnum(static_cast<unsigned char>(word.front())) &&
         std::all_of(word.begin(), word.end(), [](unsigned char c) {
           return absl::ascii_isalnum(c) || c == '.' || c == '-' || c == '_';
         });
}

}  // namespace polyest::internal
