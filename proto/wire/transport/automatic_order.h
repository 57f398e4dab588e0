#pragma once

#include <absl/strings/string_view.h>

#include <string>

namespace polyest::internal {

// Returns the text of a problem file with the word "AUTO" of `expansion.order` replaced by null.
// That is what the field without a value means, and protobuf's JSON knows no words for numbers. All
// other characters keep their places. Text that is not JSON is returned as it is, for the parser to
// refuse.
std::string WithoutAutomaticOrder(absl::string_view json);

}  // namespace polyest::internal
