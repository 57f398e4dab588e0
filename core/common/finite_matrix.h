#pragma once

#include "core/common/types.h"

namespace polyest::internal {

// Whether a matrix that was read from somewhere has this size and no element that is not finite. A
// vector is a matrix of one column.
inline bool IsFiniteMatrix(const ConstMatrixRef& matrix, Eigen::Index rows,
                           Eigen::Index columns = 1) {
  return matrix.rows() == rows && matrix.cols() == columns && matrix.allFinite();
}

}  // namespace polyest::internal
