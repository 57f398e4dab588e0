#pragma once

// Parser of expressions. The grammar, from the loosest to the tightest binding:
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
  Operation operation = Operation::kConstant;  // kVariable for a name, kLookup for a table
  int operands[3] = {-1, -1, -1};              // indices of earlier nodes
  double value = 0;                            // value of a number
  std::string name = {};                       // of a variable or a table
  size_t offset = 0;                           // position in the text in bytes, for messages
  bool swapped = false;                        // whether a > b is stored as b < a
};

// An expression as it was written. The last node is the whole expression.
struct Syntax {
  FieldPath field;  // path of the field that holds it: "model.equations.states.v"
  std::string text;
  std::vector<SyntaxNode> nodes;
};

// Parses the text. `tables` maps each table to its number of arguments. Returns InvalidArgument
// with the column for an invalid text, or ResourceExhausted for one longer than kMaxTextLength.
absl::StatusOr<Syntax> Parse(FieldPath field, std::string text,
                             const std::map<std::string, int>& tables);

// Returns the names of variables in the expression, in alphabetical order.
std::vector<std::string> VariablesIn(const Syntax& syntax);

}  // namespace polyest::internal::equations
