#pragma once

// Messages about a field, in one form: "path: what is wrong".

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

namespace polyest {

inline absl::Status InvalidField(absl::string_view path, absl::string_view message) {
  return absl::InvalidArgumentError(absl::StrCat(path, ": ", message));
}

// proto3 lets any number through where an enumeration is meant.
inline absl::Status UnknownEnumerator(absl::string_view path, int value) {
  return InvalidField(path, absl::StrCat(value, " is not one of its values"));
}

}  // namespace polyest
