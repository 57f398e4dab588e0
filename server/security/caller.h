#pragma once

// Describes who calls.

#include <absl/strings/string_view.h>

#include <optional>
#include <string>

namespace polyest::internal {

// Each role may do what those before it may. The first three are roles in the caller's tenant; an
// operator also has what concerns the sessions of all tenants.
enum class Role { kReader, kWriter, kAdmin, kOperator };

// Returns "reader", "writer", "admin" or "operator".
std::string RoleName(Role role);
// Returns the role of this name; nothing for any other word.
std::optional<Role> ParseRole(absl::string_view name);

// Describes a caller. The defaults hold for everybody where there is no authentication.
struct Caller {
  std::string tenant = "default";  // sees its own sessions only
  Role role = Role::kOperator;
  std::string name = "anonymous";  // for logs
};

// Returns whether a word may name a tenant or a caller: 1 to 64 letters, digits, '.', '-' and '_',
// the first a letter or a digit.
bool IsCallerWord(absl::string_view word);

}  // namespace polyest::internal
