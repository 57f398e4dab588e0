#pragma once

#include <absl/status/status.h>

#include <string>

#include "core/common/field_error.h"

namespace polyest::internal {

// Returns InvalidArgument that names `field` unless an output may have a delay between these
// bounds, in s. Both must be finite: samples before the largest delay has passed show what was
// before the run, those after the smallest one, if it is negative, what the inputs did after their
// last sample; neither are used.
absl::Status CheckOutputDelay(const FieldPath& field, const std::string& name, double smallest_s,
                              double largest_s);

}  // namespace polyest::internal
