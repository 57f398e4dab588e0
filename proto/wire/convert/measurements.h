#pragma once

// Measurements off the wire, as the core understands them.

#include <absl/status/statusor.h>

#include "polyest/samples.h"
#include "polyest/v1/measurements.pb.h"

namespace polyest::internal {

// Checks what the wire format leaves open: that columns are as long as there are rows, that missing
// rows exist and increase, and that every number is finite. Whether names and times suit the
// problem is for the estimator to say. INVALID_ARGUMENT names the field, the channel and the row.
absl::StatusOr<Samples> ToSamples(const v1::Measurements& measurements);

// Adds the rows of a batch to those of the batches before it. A channel that only some batches have
// misses its samples in the others.
void AppendRows(const v1::Measurements& batch, v1::Measurements& all);

}  // namespace polyest::internal
