#include "core/chaos/multi_index.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "core/common/check.h"

namespace polyest {

int64_t TotalDegreeTermCount(int dimension, int order) {
  POLYEST_CHECK(dimension >= 0 && order >= 0);
  // (n+p)!/(n! p!) = Π_{i=1}^{min} (max + i)/i; each partial product is a binomial coefficient.
  const int64_t smaller = std::min(dimension, order), larger = std::max(dimension, order);
  int64_t count = 1;
  for (int64_t i = 1; i <= smaller; ++i) {
    // Cancelled before it is multiplied, so that only the result itself can overflow.
    const int64_t common = std::gcd(count, i);
    const int64_t factor = (larger + i) / (i / common);
    if (count / common > std::numeric_limits<int64_t>::max() / factor) {
      return std::numeric_limits<int64_t>::max();
    }
    count = count / common * factor;
  }
  return count;
}

Eigen::ArrayXXi TotalDegreeIndices(int dimension, int order) {
  POLYEST_CHECK(dimension >= 1);
  const int64_t count = TotalDegreeTermCount(dimension, order);
  POLYEST_CHECK(count <= std::numeric_limits<int>::max() / dimension);
  Eigen::ArrayXXi indices(count, dimension);
  Eigen::ArrayXi current = Eigen::ArrayXi::Zero(dimension);
  Eigen::Index row = 0;
  const int last = dimension - 1;
  for (int degree = 0; degree <= order; ++degree) {
    current.setZero();
    current[0] = degree;
    indices.row(row++) = current;
    // Next in descending lexicographic order: one unit moves right from the last nonzero variable
    // before the final one, and all of the final one's units follow it.
    while (current[last] < degree) {
      int k = last - 1;
      while (current[k] == 0) --k;
      const int moved = current[last] + 1;
      current[last] = 0;
      --current[k];
      current[k + 1] = moved;
      indices.row(row++) = current;
    }
  }
  POLYEST_CHECK(row == indices.rows());
  return indices;
}

}  // namespace polyest
