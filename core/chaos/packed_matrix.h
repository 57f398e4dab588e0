#pragma once

// A matrix A that multiplies many columns. It is kept in tiles of a few rows, as wide as the
// processor's vectors; a tile stays in the nearest cache while it multiplies some columns, and a
// product allocates nothing. Each element of a product is summed in the order of the inner index,
// so that the product of a column depends neither on the other columns nor on its place among them.
//
// Source: Goto and van de Geijn, Anatomy of High-Performance Matrix Multiplication, ACM Trans.
// Math. Softw. 34 (2008).

#include <Eigen/Core>

#include "core/common/types.h"

namespace polyest::internal {

class PackedMatrix {
 public:
  static constexpr int kTile = 8;  // rows

  PackedMatrix() = default;
  explicit PackedMatrix(const ConstMatrixRef& a);  // copies A, m × k

  Eigen::Index rows() const { return rows_; }  // m
  Eigen::Index cols() const { return cols_; }  // k
  // Returns A.
  Matrix Unpacked() const;
  // Multiply writes A X (m × n) into `product`, Subtract writes Y − A X into `difference`; X is
  // k × n. Y may be `difference`.
  void Multiply(const ConstMatrixRef& x, MatrixRef product) const;
  void Subtract(const ConstMatrixRef& x, const ConstMatrixRef& y, MatrixRef difference) const;
  // Replaces the rows of X (m × n) by those of A X, a tile of rows after the other from the last
  // upwards: each is computed from X with the rows below it replaced already. A is square, and 0
  // left of the tiles on its diagonal.
  void SweepUpwards(MatrixRef x) const;

 private:
  using TileColumn = Eigen::Array<double, kTile, 1>;

  template <bool kSubtracts>
  void Run(const ConstMatrixRef& x, const ConstMatrixRef& y, MatrixRef product) const;
  template <bool kSubtracts, int kTiles, int kColumns>
  void RunSome(Eigen::Index tile, const ConstMatrixRef& x, const ConstMatrixRef& y,
               Eigen::Index first, MatrixRef product, Eigen::Index from = 0) const;

  Eigen::Index rows_ = 0, cols_ = 0;
  // The tiles in order; the last is filled up with zeros.
  Eigen::Array<double, kTile, Eigen::Dynamic> tiles_;
};

}  // namespace polyest::internal
