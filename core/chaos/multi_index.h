#pragma once

// The multi-indices of an expansion: each gives the degrees of the germs' polynomials whose product
// is a term. They form the hyperbolic set
//   {j : j_1^q + … + j_n^q ≤ p^q},   0 < q ≤ 1.
// q = 1 truncates at the total degree. A smaller q leaves out products of many variables first,
// which are the most numerous and matter least in mechanical systems (G. Blatman and B. Sudret,
// "Adaptive sparse polynomial chaos expansion based on least angle regression", J. Comput. Phys.
// 230 (2011)). If the set has an index, it has all smaller ones.

#include <Eigen/Core>
#include <cstdint>

namespace polyest::internal {

struct Truncation {
  int order = 3;        // p ≥ 0
  double exponent = 1;  // q in (0, 1]
};

// Returns the number of terms of the total-degree set, S = (n+p)!/(n! p!); saturates at the largest
// int64.
int64_t TotalDegreeTermCount(int dimension, int order);

// Returns the number of terms of the hyperbolic set, or `most` + 1 if it has more than `most`.
int64_t TermCount(int dimension, const Truncation& truncation, int64_t most);

// Returns the multi-indices as rows, S × n, sorted by total degree (row 0 is the constant) and
// within a degree lexicographically, first variable leading.
Eigen::ArrayXXi MultiIndices(int dimension, const Truncation& truncation);

}  // namespace polyest::internal
