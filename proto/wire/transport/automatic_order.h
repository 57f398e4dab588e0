#pragma once

#include <absl/strings/string_view.h>

#include <string>

namespace polyest::internal {

// Returns the text of a problem file with the word "AUTO" of `expansion.order` replaced by null.
// A field without a value means the automatic order, and protobuf's JSON parser accepts no word for
// a number. All other characters keep their positions. Text that is not JSON is returned unchanged,
// so that the parser refuses it.
std::string WithoutAutomaticOrder(absl::string_view json);

// Returns the text of a request, in which problems may be anywhere, with all those words replaced.
std::string WithoutAutomaticOrders(absl::string_view json);

}  // namespace polyest::internal
