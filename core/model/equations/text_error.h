#pragma once

// Messages about a place in a text.

#include <absl/status/status.h>

#include <cstddef>
#include <string>
#include <string_view>

#include "core/common/field_error.h"

namespace polyest::internal::equations {

// "FIELD: column 7: MESSAGE (at "sine(x)")": `offset` bytes into `text`, counted in characters from
// 1. What is quoted is valid UTF-8 on one line whatever the text.
absl::Status ErrorAt(const FieldPath& field, std::string_view text, size_t offset,
                     std::string_view message);

// The text in quotation marks, fit for a message: cut where it is long, escaped where it is not
// plain.
std::string Quoted(std::string_view text);

}  // namespace polyest::internal::equations
