#pragma once

// Reads a number as files of measurements write it.

#include <absl/strings/string_view.h>

namespace polyest::internal {

struct NumberStyle {
  char decimal = '.';  // or ','
  // Whether the user has named the decimal mark. A cell like "1.234" has one meaning then.
  bool named = false;
};

struct NumberCell {
  enum Kind {
    kNumber,
    kMissing,       // empty, or a word for a missing value: NaN, NA, #N/A, -, …
    kNoNumber,      // any other text
    kOutOfRange,    // of a double
    kNotFinite,     // an infinity
    kOtherDecimal,  // a number with the other decimal mark
    kTwoReadings,   // 1,234 (or 1.234): the mark may be the decimal mark or group thousands
  };
  Kind kind = kNoNumber;
  double value = 0;  // of kNumber
};

// Reads the text of a cell, which has no white space around it. Thousands may be grouped by the
// mark that is not the decimal mark, by apostrophes or by no-break spaces, where only one reading
// is possible: "1.234,5", "1'234". The minus may be U+2212. Allocates nothing.
NumberCell ReadNumberCell(absl::string_view text, const NumberStyle& style);

// Whether a word stands for a missing value, as kMissing says.
bool IsMissingWord(absl::string_view text);

// What a cell tells about the decimal mark of its file.
enum class DecimalEvidence {
  kNone,
  kPoint,         // "0.5", "1,234.5"
  kComma,         // "0,5", "1.234,5"
  kCommaOrGroup,  // "1,234"
};
DecimalEvidence DecimalEvidenceOf(absl::string_view text);

}  // namespace polyest::internal
