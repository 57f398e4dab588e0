#pragma once

// The functions that can be called in an expression, and the words that mean something there.

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
  int max_arguments;  // more than three only where the operation is associative
};

// Nullptr if there is none of that name.
const Function* FindFunction(std::string_view name);

// t, pi and the names of the functions.
bool IsReserved(std::string_view name);

// A letter or _, then letters, digits and _, of ASCII; of at most kMaxNameLength.
bool IsName(std::string_view text);

// "; do you mean sin?" if a function or one of the names is near, otherwise "; the functions are
// abs, …".
std::string SuggestFunction(std::string_view unknown, const std::vector<std::string>& tables);

}  // namespace polyest::internal::equations
