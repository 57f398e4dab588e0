#pragma once

// Measurements off the wire, as the core understands them.

#include <absl/status/statusor.h>

#include "core/estimator/samples.h"
#include "polyest/v1/measurements.pb.h"

namespace polyest {

// Checks what the wire format leaves open: that columns are as long as there are rows, that missing
// rows exist and increase, and that every number is finite. Whether names and times suit the
// problem is for the estimator to say. INVALID_ARGUMENT names the field, the channel and the row.
absl::StatusOr<Samples> ToSamples(const v1::Measurements& measurements);

}  // namespace polyest
