#pragma once

// Renames the fields in error messages. The core names fields of its own structures
// (`expansion.points_per_term`); the sender of a request knows the fields of the message by their
// JSON names (`expansion.pointsPerTerm`).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

namespace polyest::internal {

// Returns the status with its field under the JSON name, and a status without a field unchanged.
// JSON names stay as they are, so that the function may be applied twice.
absl::Status WireFields(const absl::Status& status);
template <typename Value>
absl::StatusOr<Value> WireFields(absl::StatusOr<Value> value) {
  if (value.ok()) return value;
  return WireFields(value.status());
}

}  // namespace polyest::internal
