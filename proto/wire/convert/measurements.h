#pragma once

// Converts measurements from their protobuf message to the samples of the core.

#include <absl/status/statusor.h>

#include "polyest/model.h"
#include "polyest/samples.h"
#include "polyest/v1/measurements.pb.h"

namespace polyest::internal {

// Converts measurements, in units of their own, and checks what the message format leaves open:
// that each column has one value per row, that missing rows exist and increase, and that every
// number is finite. The estimator checks whether names and times suit the problem. INVALID_ARGUMENT
// names the field, the channel and the row.
absl::StatusOr<Samples> ToSamples(const v1::Measurements& measurements, const Model& model);

// Appends the rows of a batch to those of the batches before it. In the rows of a batch that lacks
// a channel, the samples of that channel are missing.
void AppendRows(const v1::Measurements& batch, v1::Measurements& all);

// Appends rows in units of the model, as above.
void AppendRows(const Samples& rows, v1::Measurements& all);

// Puts the rows of a session with a reorder window, all of which are given, into the order of runs
// and times; samples of different channels at the same time become one row.
void PutInTimeOrder(v1::Measurements& rows);

}  // namespace polyest::internal
