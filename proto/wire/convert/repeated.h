#pragma once

// Appends vectors and matrices to repeated fields.

#include <google/protobuf/repeated_field.h>

#include "polyest/types.h"

namespace polyest::internal {

inline void Append(const Vector& values, google::protobuf::RepeatedField<double>& added) {
  added.Add(values.data(), values.data() + values.size());
}

// Appends a matrix in row-major order, whatever its storage order.
inline void Append(const Matrix& values, google::protobuf::RepeatedField<double>& added) {
  added.Reserve(added.size() + static_cast<int>(values.size()));
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    for (Eigen::Index column = 0; column < values.cols(); ++column) {
      added.Add(values(row, column));
    }
  }
}

}  // namespace polyest::internal
