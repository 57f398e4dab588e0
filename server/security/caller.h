#pragma once

// Who calls.

#include <absl/strings/string_view.h>

#include <optional>
#include <string>

namespace polyest::internal {

// Each may do what those before it may.
enum class Role { kReader, kWriter, kAdmin };

// "reader", "writer", "admin".
std::string RoleName(Role role);
// None for any other word.
std::optional<Role> ParseRole(absl::string_view name);

// The defaults are of everybody where there is no authentication.
struct Caller {
  std::string tenant = "default";  // sees its own sessions only
  Role role = Role::kAdmin;
  std::string name = "anonymous";  // for logs
};

// A word that may name a tenant or a caller: 1 to 64 letters, digits, '.', '-' and '_', the first a
// letter or a digit.
bool IsCallerWord(absl::string_view word);

}  // namespace polyest::internal
