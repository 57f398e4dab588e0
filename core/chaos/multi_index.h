#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace polyest {

// Number of terms of the total-degree set, S = (n+p)!/(n! p!); saturates at the largest int64.
int64_t TotalDegreeTermCount(int dimension, int order);

// The total-degree multi-indices {j : j_1 + … + j_n ≤ order}, one a row, S × n, sorted by total
// degree (row 0 is the constant) and within a degree lexicographically, first variable leading.
Eigen::ArrayXXi TotalDegreeIndices(int dimension, int order);

}  // namespace polyest
