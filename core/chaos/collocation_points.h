#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "core/chaos/germ.h"
#include "core/common/types.h"

namespace polyest {

enum class PointSet { kHalton, kHammersley, kGaussTensor };

// The first `count` points of the low-discrepancy sequence in the open unit cube, count × n;
// (Halton: radical inverses in the first n primes of 1, 2, …; Hammersley: its first coordinate is
// (i + ½)/count.) Not for kGaussTensor.
Matrix UnitCubePoints(PointSet set, int dimension, int count);

// Collocation points in germ coordinates, Q × n: unit-cube points through each germ's quantile
// function, or the tensor grid of the (order + 1)-point Gauss rules of the germs' own polynomials
// (then `count` is ignored and Q = (order + 1)^n).
// RESOURCE_EXHAUSTED if the grid exceeds `most_points`.
absl::StatusOr<Matrix> CollocationPoints(PointSet set, const std::vector<Germ>& germs, int order,
                                         int count, int most_points = 100'000);

}  // namespace polyest
