#include "core/chaos/packed_matrix.h"

#include <algorithm>
#include <array>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// So many columns, or tiles of one column, are multiplied together: as many as have room in
// registers, and enough for their sums not to wait for each other.
constexpr int kColumnsTogether = 6;
constexpr int kTilesTogether = 4;
// So many columns pass a tile before the next one is read: as many as the second cache holds.
constexpr Eigen::Index kPassing = 6 * kColumnsTogether;

// Copy a column of a tile, of which the last one may have fewer rows.
template <class TileColumn>
void Load(const double* from, Eigen::Index rows, TileColumn& column) {
  if (rows >= column.size()) {
    column = TileColumn::Map(from);
  } else {
    std::copy_n(from, rows, column.data());
  }
}

template <class TileColumn>
void Store(const TileColumn& column, Eigen::Index rows, double* to) {
  if (rows >= column.size()) {
    TileColumn::Map(to) = column;
  } else {
    std::copy_n(column.data(), rows, to);
  }
}

}  // namespace

PackedMatrix::PackedMatrix(const ConstMatrixRef& a) : rows_(a.rows()), cols_(a.cols()) {
  const Eigen::Index tiles = (rows_ + kTile - 1) / kTile;
  tiles_.setZero(kTile, tiles * cols_);
  for (Eigen::Index tile = 0; tile < tiles; ++tile) {
    const Eigen::Index first = tile * kTile;
    const Eigen::Index count = std::min<Eigen::Index>(kTile, rows_ - first);
    tiles_.block(0, tile * cols_, count, cols_) = a.middleRows(first, count).array();
  }
}

Matrix PackedMatrix::Unpacked() const {
  Matrix a(rows_, cols_);
  for (Eigen::Index first = 0; first < rows_; first += kTile) {
    const Eigen::Index count = std::min<Eigen::Index>(kTile, rows_ - first);
    a.middleRows(first, count) = tiles_.block(0, first / kTile * cols_, count, cols_).matrix();
  }
  return a;
}

void PackedMatrix::Multiply(const ConstMatrixRef& x, MatrixRef product) const {
  Run<false>(x, product, product);
}

void PackedMatrix::Subtract(const ConstMatrixRef& x, const ConstMatrixRef& y,
                            MatrixRef difference) const {
  POLYEST_CHECK(y.rows() == rows_ && y.cols() == x.cols());
  Run<true>(x, y, difference);
}

void PackedMatrix::SweepUpwards(MatrixRef x) const {
  POLYEST_CHECK(rows_ == cols_ && x.rows() == rows_);
  for (Eigen::Index tile = (rows_ + kTile - 1) / kTile; tile-- > 0;) {
    Eigen::Index column = 0;
    for (; column + kColumnsTogether <= x.cols(); column += kColumnsTogether) {
      RunSome<false, 1, kColumnsTogether>(tile, x, x, column, x, tile * kTile);
    }
    for (; column < x.cols(); ++column) RunSome<false, 1, 1>(tile, x, x, column, x, tile * kTile);
  }
}

template <bool kSubtracts>
void PackedMatrix::Run(const ConstMatrixRef& x, const ConstMatrixRef& y, MatrixRef product) const {
  POLYEST_CHECK(x.rows() == cols_ && product.rows() == rows_ && product.cols() == x.cols());
  const Eigen::Index tiles = (rows_ + kTile - 1) / kTile;
  for (Eigen::Index begin = 0; begin < x.cols(); begin += kPassing) {
    const Eigen::Index end = std::min(begin + kPassing, x.cols());
    const Eigen::Index whole = end - (end - begin) % kColumnsTogether;
    for (Eigen::Index tile = 0; tile < tiles; ++tile) {
      for (Eigen::Index column = begin; column < whole; column += kColumnsTogether) {
        RunSome<kSubtracts, 1, kColumnsTogether>(tile, x, y, column, product);
      }
    }
    for (Eigen::Index column = whole; column < end; ++column) {
      Eigen::Index tile = 0;
      for (; tile + kTilesTogether <= tiles; tile += kTilesTogether) {
        RunSome<kSubtracts, kTilesTogether, 1>(tile, x, y, column, product);
      }
      for (; tile < tiles; ++tile) RunSome<kSubtracts, 1, 1>(tile, x, y, column, product);
    }
  }
}

// Multiplies kTiles tiles from `tile` on and kColumns columns from `first` on, with the inner index
// from `from` on. All of X is read before the product is written.
template <bool kSubtracts, int kTiles, int kColumns>
void PackedMatrix::RunSome(Eigen::Index tile, const ConstMatrixRef& x, const ConstMatrixRef& y,
                           Eigen::Index first, MatrixRef product, Eigen::Index from) const {
  std::array<std::array<TileColumn, kColumns>, kTiles> sums;
  std::array<const double*, kColumns> factors;
  // The last tile may lack rows.
  const auto rows_of = [&](int t) { return rows_ - (tile + t) * kTile; };
  const auto row_of = [&](int t) { return (tile + t) * kTile; };
  for (int i = 0; i < kColumns; ++i) {
    factors[i] = x.col(first + i).data();
    for (int t = 0; t < kTiles; ++t) {
      sums[t][i].setZero();
      if constexpr (kSubtracts) Load(&y.coeffRef(row_of(t), first + i), rows_of(t), sums[t][i]);
    }
  }
  for (Eigen::Index k = from; k < cols_; ++k) {
    for (int t = 0; t < kTiles; ++t) {
      const TileColumn values = tiles_.col((tile + t) * cols_ + k);
      for (int i = 0; i < kColumns; ++i) {
        if constexpr (kSubtracts) {
          sums[t][i] -= values * factors[i][k];
        } else {
          sums[t][i] += values * factors[i][k];
        }
      }
    }
  }
  for (int t = 0; t < kTiles; ++t) {
    for (int i = 0; i < kColumns; ++i) {
      Store(sums[t][i], rows_of(t), &product.coeffRef(row_of(t), first + i));
    }
  }
}

}  // namespace polyest::internal
