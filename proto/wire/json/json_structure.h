#pragma once

// Checks of a JSON text that must come before protobuf's parser, which takes deeply nested brackets
// in more than quadratic time, lets the last of several equal fields win, and leaves out a null in
// a list, so that what follows takes its place.
//
// Protobuf also reads what is not quite JSON: names without quotes, text in single quotes, a comma
// at the end. A strict parser cannot check what such a text means to protobuf, so this is a scan
// that knows brackets, strings and names only. It leaves other errors to protobuf.

#include <absl/strings/string_view.h>

#include <optional>

#include "proto/wire/json/json_error.h"

namespace polyest::internal {

// How deep objects and arrays may be in one another. The contract's messages have no more than 20.
constexpr int kMaxJsonDepth = 100;

// Returns the first place with deeper brackets, with a field that its object has already or with a
// null in a list; none if there is no such place. The names of fields are compared as they are
// written. Takes time in proportion to the text.
std::optional<JsonError> CheckJsonStructure(absl::string_view json);

}  // namespace polyest::internal
