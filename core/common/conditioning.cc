#include <Eigen/SVD>
#include <limits>

#include "core/common/linear_algebra.h"

namespace polyest::internal {

Conditioning ConditioningOf(const Matrix& matrix) {
  Conditioning result{0, std::numeric_limits<double>::infinity()};
  // BDCSVD leaves garbage when its input is not finite, and says so.
  const Eigen::BDCSVD<Matrix> svd(matrix);
  if (svd.info() != Eigen::Success) return result;
  result.rank = svd.rank();
  const Vector& values = svd.singularValues();
  const double smallest = values[values.size() - 1];
  if (smallest > 0) result.number = values[0] / smallest;
  return result;
}

}  // namespace polyest::internal
