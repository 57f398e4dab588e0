#pragma once

// Names of Eigen's types in polyest's interfaces.

#include <Eigen/Core>

namespace polyest {

// A column of numbers.
using Vector = Eigen::VectorXd;
// Rows × columns of numbers, stored column by column.
using Matrix = Eigen::MatrixXd;
// A vector to be written to, without a copy.
using VectorRef = Eigen::Ref<Vector>;
// A vector to be read, without a copy where it is contiguous.
using ConstVectorRef = Eigen::Ref<const Vector>;
// A matrix to be written to, without a copy.
using MatrixRef = Eigen::Ref<Matrix>;
// A matrix to be read, without a copy where its columns are contiguous.
using ConstMatrixRef = Eigen::Ref<const Matrix>;

// A block of trajectories to be written to: each row is a trajectory and each column a quantity.
// Columns are contiguous, so one instruction works on several trajectories.
using Block = Eigen::Ref<Eigen::ArrayXXd>;
// A block of trajectories to be read.
using ConstBlock = Eigen::Ref<const Eigen::ArrayXXd>;

// The number of rows of every block that a model sees is a multiple of this number.
inline constexpr int kLanes = 8;

}  // namespace polyest
