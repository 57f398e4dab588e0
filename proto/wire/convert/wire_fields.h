#pragma once

// Fields as the wire names them. The core refuses fields of its own structures
// (`expansion.points_per_term`); who sent a message knows those of the message, in JSON's names
// (`expansion.pointsPerTerm`).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

namespace polyest::internal {

// Returns the status with its field under the wire's name; any other status as it is. Wire names
// stay, so that it may be applied again.
absl::Status WireFields(const absl::Status& status);
template <typename Value>
absl::StatusOr<Value> WireFields(absl::StatusOr<Value> value) {
  if (value.ok()) return value;
  return WireFields(value.status());
}

}  // namespace polyest::internal
