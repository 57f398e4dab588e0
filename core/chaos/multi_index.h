#pragma once

// Which products of the germs' polynomials an expansion has: the multi-indices of the hyperbolic
// set
//   {j : j_1^q + … + j_n^q ≤ p^q},   0 < q ≤ 1.
// q = 1 is the total degree; a smaller one leaves out products of many variables first, which in
// mechanical systems matter least and are the most (G. Blatman and B. Sudret, "Adaptive sparse
// polynomial chaos expansion based on least angle regression", J. Comput. Phys. 230 (2011)). With
// every index the set has all smaller ones.

#include <Eigen/Core>
#include <cstdint>

namespace polyest {

struct Truncation {
  int order = 3;        // p ≥ 0
  double exponent = 1;  // q in (0, 1]
};

// Number of terms of the total-degree set, S = (n+p)!/(n! p!); saturates at the largest int64.
int64_t TotalDegreeTermCount(int dimension, int order);

// Number of terms of the hyperbolic set, or `most` + 1 where it has more.
int64_t TermCount(int dimension, const Truncation& truncation, int64_t most);

// The multi-indices, one a row, S × n, sorted by total degree (row 0 is the constant) and within a
// degree lexicographically, first variable leading.
Eigen::ArrayXXi MultiIndices(int dimension, const Truncation& truncation);

}  // namespace polyest
