#pragma once

// Splits the text of an expression into tokens.

#include <absl/status/statusor.h>

#include <string>
#include <string_view>

#include "core/common/field_error.h"

namespace polyest::internal::equations {

struct Token {
  enum class Kind { kNumber, kName, kSymbol, kEnd };
  Kind kind = Kind::kEnd;
  size_t offset = 0;           // bytes from the beginning of the text
  std::string_view text = {};  // the name, the symbol ("<=", "(" …) or the number as written
  double value = 0;            // value of a number, finite
};

class Lexer {
 public:
  // Reads `text`; errors name `field`. Both must outlive the lexer and its tokens.
  Lexer(const FieldPath& field, std::string_view text) : field_(field), text_(text) {}

  // Returns the next token, kEnd at the end of the text. Returns InvalidArgument with the column if
  // the text contains no valid token there.
  absl::StatusOr<Token> Next();

 private:
  absl::StatusOr<Token> Number();
  absl::StatusOr<Token> Symbol();
  size_t Skip(size_t from, bool (*belongs)(char)) const;
  absl::Status Error(size_t offset, std::string_view message) const;

  const FieldPath& field_;
  std::string_view text_;
  size_t offset_ = 0;
};

}  // namespace polyest::internal::equations
