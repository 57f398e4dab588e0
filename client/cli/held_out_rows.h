#pragma once

// The rows of a record that a problem is estimated from when it must predict the others.

#include <cstdint>

#include "polyest/v1/measurements.pb.h"

namespace polyest::internal {

// Returns the first `rows` rows.
v1::Measurements FirstRows(const v1::Measurements& measurements, int64_t rows);

}  // namespace polyest::internal
