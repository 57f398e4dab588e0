#pragma once

// The functions and the reserved words of an expression.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/model/equations/operation.h"

namespace polyest::internal::equations {

struct Function {
  std::string_view name;
  Operation operation;
  int min_arguments;
  int max_arguments;  // above three only for an associative operation
};

// Returns nullptr if no function has that name.
const Function* FindFunction(std::string_view name);

// Whether the name is t, pi or that of a function.
bool IsReserved(std::string_view name);

// Whether the text is an ASCII letter or _, followed by ASCII letters, digits and _, with at most
// kMaxNameLength characters.
bool IsName(std::string_view text);

// Returns `; did you mean "sin"?` if the name of a function or a table is near `unknown`, otherwise
// "; the functions are abs, …".
std::string SuggestFunction(std::string_view unknown, const std::vector<std::string>& tables);

}  // namespace polyest::internal::equations
