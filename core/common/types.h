#pragma once

// The few Eigen names that the whole library shares.

#include <Eigen/Core>

namespace polyest {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;
using VectorRef = Eigen::Ref<Vector>;
using ConstVectorRef = Eigen::Ref<const Vector>;
using MatrixRef = Eigen::Ref<Matrix>;
using ConstMatrixRef = Eigen::Ref<const Matrix>;

// A block of an ensemble in structure-of-arrays layout: one row a collocation point, one column a
// quantity. Each column is contiguous, so that one instruction works on several points.
using Block = Eigen::Ref<Eigen::ArrayXXd>;
using ConstBlock = Eigen::Ref<const Eigen::ArrayXXd>;

// The number of rows of every block that a model sees is a multiple of this many points.
inline constexpr int kLanes = 8;

}  // namespace polyest
