#pragma once

// Errors for values that a protobuf message can hold, but no structure of the core.

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include "core/common/field_error.h"

namespace polyest::internal {

// Returns the error for an enumeration field with a number that is none of its values. proto3
// accepts any number there.
inline absl::Status UnknownEnumerator(const FieldPath& field, int value) {
  return InvalidField(field, absl::StrCat(value, " is not a valid value"));
}

}  // namespace polyest::internal
