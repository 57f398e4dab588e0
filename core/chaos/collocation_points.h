#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "core/chaos/germ.h"
#include "core/common/types.h"
#include "polyest/expansion_options.h"

namespace polyest::internal {

// Returns the first `count` points of a low-discrepancy sequence in the open unit cube, count × n.
// Halton's coordinates are the radical inverses of 1, 2, … in the first n primes; Hammersley's
// first coordinate is (i + ½)/count and the others are Halton's first n − 1. `set` must not be
// kGaussTensor.
//
// The digits in the primes from 7 on are permuted, because in two large primes the plain sequence
// begins as two rising ramps that hardly differ: with 182 points in 12 dimensions the collocation
// matrix of order 2 has condition number 68. With the permutations of H. Faure, "Good permutations
// for extreme discrepancy", J. Number Theory 42 (1992), it has 5.3, less than independent random
// points (6 to 7). The permutations follow from σ_2 = (0, 1) by σ_{2m} = (2σ_m, 2σ_m + 1) and, for
// odd b, by raising the digits of σ_{b−1} from (b−1)/2 on by one and inserting (b−1)/2 in the
// middle; zero stays zero. In bases beyond the number of points these, too, make coordinates that
// hardly differ: with 82 points in 40 dimensions the condition number of order 1 is 700, with 130
// in 64 it is 1,000. The primes beyond 89 therefore have fixed random permutations, which make
// it 5. The primes 2, 3 and 5 are not permuted, so few dimensions give Halton's own points.
Matrix UnitCubePoints(PointSet set, int dimension, int count);

// Returns the first `count` points of Halton's sequence mapped by each germ's quantile function,
// count × n: draws of the germs that are spread evenly.
Matrix HaltonDraws(const std::vector<Germ>& germs, int count);

// Returns collocation points in germ coordinates, Q × n: unit-cube points mapped by each germ's
// quantile function, or the tensor grid of the (order + 1)-point Gauss rules of the germs' own
// polynomials; then `count` is ignored and Q = (order + 1)^n. Returns RESOURCE_EXHAUSTED if the
// grid has more than `max_points`.
absl::StatusOr<Matrix> CollocationPoints(PointSet set, const std::vector<Germ>& germs, int order,
                                         int count, int max_points = 100'000);

}  // namespace polyest::internal
