#pragma once

// Checks of a JSON text that must come before protobuf's parser. That parser takes deeply nested
// brackets in more than quadratic time, lets the last of several equal fields win, and takes a null
// for 0 or, in a list, leaves it out, so that what follows takes its place. It also reads what is
// not JSON, such as names without quotes or a comma behind the last value, which other programs
// refuse, and says of what it refuses neither line nor column.

#include <absl/strings/string_view.h>
#include <google/protobuf/descriptor.h>

#include <optional>

#include "proto/wire/json/json_error.h"

namespace polyest::internal {

// How deep objects and arrays may be in one another. The contract's messages have no more than 20.
constexpr int kMaxJsonDepth = 100;

// Returns the first place at which a text is no JSON (RFC 8259), has a number beyond the range of a
// double or deeper brackets, has a field that its object has already, or a null in a list or in
// place of a value of `type`, the message that the text should hold. None if there is no such
// place. Takes time in proportion to the text.
std::optional<JsonError> CheckJsonStructure(absl::string_view json,
                                            const google::protobuf::Descriptor& type);

}  // namespace polyest::internal
