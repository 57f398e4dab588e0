#pragma once

// Reads an expression. Grammar, from the loosest to the tightest binding:
//
//   or          = and { "||" and }
//   and         = comparison { "&&" comparison }
//   comparison  = sum [ ("<" | "<=" | ">" | ">=" | "==" | "!=") sum ]
//   sum         = product { ("+" | "-") product }
//   product     = sign { ("*" | "/") sign }
//   sign        = ("-" | "+" | "!") sign | power
//   power       = primary [ "^" sign ]
//   primary     = number | name | name "(" or { "," or } ")" | "(" or ")"

#include <absl/status/statusor.h>

#include <map>
#include <string>
#include <vector>

#include "core/common/field_error.h"
#include "core/model/equations/operation.h"

namespace polyest::internal::equations {

struct SyntaxNode {
  Operation operation = Operation::kConstant;  // kVariable: a name; kLookup: a table's
  int operands[3] = {-1, -1, -1};              // nodes before this one
  double value = 0;                            // of a number
  std::string name = {};                       // of a name or a table
  size_t offset = 0;                           // into the text, for messages
  bool swapped = false;                        // a > b, kept as b < a
};

// An expression as it was written; the last node is the whole.
struct Syntax {
  FieldPath field;  // where it stands, as in "model.equations.states.v"
  std::string text;
  std::vector<SyntaxNode> nodes;
};

// `tables`: how many arguments each takes. Errors are INVALID_ARGUMENT with the column, or
// RESOURCE_EXHAUSTED for a text longer than kMaxTextLength.
absl::StatusOr<Syntax> Parse(FieldPath field, std::string text,
                             const std::map<std::string, int>& tables);

}  // namespace polyest::internal::equations
