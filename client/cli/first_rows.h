#pragma once

#include <cstdint>

#include "polyest/v1/measurements.pb.h"

namespace polyest::internal {

// Returns the first `rows` rows; all if there are not so many.
v1::Measurements FirstRows(v1::Measurements measurements, int64_t rows);

}  // namespace polyest::internal
