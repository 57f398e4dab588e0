#pragma once

// Divides a record into the rows that a problem is estimated from and those that it must predict.

#include <cstdint>

#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// Returns the first `rows` rows.
v1::Measurements FirstRows(const v1::Measurements& measurements, int64_t rows);

// Returns the measurements without the samples of the problem's measured outputs in the first
// `rows` rows. Its inputs stay, since the model needs them to reach the other rows.
v1::Measurements WithoutFirstSamples(const v1::Measurements& measurements,
                                     const v1::Problem& problem, int64_t rows);

}  // namespace polyest::internal
