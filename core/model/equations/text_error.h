#pragma once

// Error messages that point to a place in a text.

#include <absl/status/status.h>

#include <cstddef>
#include <string>
#include <string_view>

#include "core/common/field_error.h"

namespace polyest::internal::equations {

// Returns InvalidArgument with "FIELD: column 7: MESSAGE (at "sine(x)")". `offset` is in bytes; the
// column counts characters from 1. The quotation is valid UTF-8 on one line, whatever the text.
absl::Status ErrorAt(const FieldPath& field, std::string_view text, size_t offset,
                     std::string_view message);

// Returns the text in quotation marks for a message. Cuts it after 24 bytes and escapes it if it
// contains control characters or is not valid UTF-8.
std::string Quoted(std::string_view text);

}  // namespace polyest::internal::equations
