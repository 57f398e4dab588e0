#pragma once

// Says what is wrong with a JSON text, from the message of protobuf's parser.

#include <absl/strings/string_view.h>

#include <cstdint>
#include <string>

namespace polyest::internal {

struct JsonError {
  int64_t line = 0;  // of a syntax error, from 1; 0: not known, or the syntax is right
  std::string what;  // one line, which begins with the path of the field if one is wrong
};

// Returns what is wrong with `json`, of which protobuf's parser said `message`.
JsonError DescribeJsonError(absl::string_view json, absl::string_view message);

}  // namespace polyest::internal
