#pragma once

#include <absl/status/status.h>

#include <string>

#include "core/common/field_error.h"

namespace polyest::internal {

// Returns InvalidArgument that names `field` unless an output may have a delay between these
// bounds, in s. Both must be finite: samples before the largest delay has passed show what was
// before the run, and are not used. With streamed inputs the model cannot be run ahead of the
// samples, so that the delay must not be negative.
absl::Status CheckOutputDelay(const FieldPath& field, const std::string& name, double smallest_s,
                              double largest_s, bool inputs_streamed);

}  // namespace polyest::internal
