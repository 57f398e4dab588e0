#pragma once

// Says what is wrong with a JSON text.

#include <absl/strings/string_view.h>

#include <cstdint>
#include <string>

namespace polyest::internal {

// An error at a place of a text.
struct JsonError {
  int64_t line = 1;    // counted from 1
  int64_t column = 1;  // in characters, counted from 1
  std::string field;   // the path of the value that is wrong; empty: the text is no JSON
  std::string rule;    // what is wrong with it, in one line

  // Returns the field, if any, and the rule.
  std::string Sentence() const { return field.empty() ? rule : field + ": " + rule; }
};

// Returns what protobuf's parser says of a text that is JSON but not its message, in one line that
// begins with the path of the field if one is wrong.
std::string DescribeParserMessage(absl::string_view message);

}  // namespace polyest::internal
