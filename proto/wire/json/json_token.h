#pragma once

// The tokens of a JSON text (RFC 8259): texts in quotes and words, among them numbers.

#include <absl/strings/string_view.h>

#include <cstddef>
#include <string>

namespace polyest::internal {

// A text in quotes.
struct JsonToken {
  size_t end = 0;    // the place behind its closing quote
  size_t wrong = 0;  // the place of an error in it
  std::string rule;  // what is wrong there; empty: nothing
};

// Returns the text whose opening quote is at `begin`.
JsonToken TextToken(absl::string_view json, size_t begin);

// Returns the word at a place, up to the next blank, bracket, quote or other sign; empty if there
// is none. Letters, digits, the signs of numbers and all that is not ASCII belong to words.
absl::string_view WordAt(absl::string_view json, size_t at);

// Returns a whole token for a message: a text with its quotes, a word or a sign.
absl::string_view TokenAt(absl::string_view json, size_t at);

// Returns whether a word is a number as JSON writes it: "-1.5e3", not "+1", ".5", "1.", "007" or
// "0x10".
bool IsJsonNumber(absl::string_view word);

// Returns whether a number is within the range of a double.
bool IsInRange(absl::string_view number);

}  // namespace polyest::internal
