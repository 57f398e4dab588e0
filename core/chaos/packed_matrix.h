#pragma once

// A matrix that many columns are multiplied by. Its rows lie together in tiles as wide as the
// processor's vectors, a tile stays in the nearest cache while columns pass, and no memory is
// needed for a product. Each element of a product is summed in the order of the inner index: what
// comes out for a column depends neither on the others nor on its place among them.
//
// Source: Goto and van de Geijn, Anatomy of High-Performance Matrix Multiplication, ACM Trans.
// Math. Softw. 34 (2008).

#include <Eigen/Core>

#include "core/common/types.h"

namespace polyest::internal {

class PackedMatrix {
 public:
  PackedMatrix() = default;
  explicit PackedMatrix(const ConstMatrixRef& a);

  Eigen::Index rows() const { return rows_; }
  Eigen::Index cols() const { return cols_; }
  Matrix Unpacked() const;
  // Writes A X into `product` (m × n), or subtracts it from that; X is k × n.
  void Multiply(const ConstMatrixRef& x, MatrixRef product) const;
  void Subtract(const ConstMatrixRef& x, MatrixRef product) const;

 private:
  static constexpr int kTile = 8;  // rows
  using TileColumn = Eigen::Array<double, kTile, 1>;

  template <bool kSubtracts>
  void Run(const ConstMatrixRef& x, MatrixRef product) const;
  template <bool kSubtracts, int kTiles, int kColumns>
  void RunSome(Eigen::Index tile, const ConstMatrixRef& x, Eigen::Index first,
               MatrixRef product) const;

  Eigen::Index rows_ = 0, cols_ = 0;
  Eigen::Array<double, kTile, Eigen::Dynamic> tiles_;  // one behind the other, filled up with 0
};

}  // namespace polyest::internal
