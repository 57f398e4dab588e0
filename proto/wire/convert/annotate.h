#pragma once

// Refusals of what a message may hold and no structure of the core can.

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include "core/common/field_error.h"

namespace polyest::internal {

// proto3 lets any number through where an enumeration is meant.
inline absl::Status UnknownEnumerator(const FieldPath& field, int value) {
  return InvalidField(field, absl::StrCat(value, " is not one of its values"));
}

}  // namespace polyest::internal
