#pragma once

// LU factors of one small dense matrix for each point, computed for kLanes points at a time:
//
//   P_p A_p = L_p U_p, partial pivoting for each point on its own.
//
// A singular matrix gives a solution that is not finite.

#include <Eigen/Core>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

class BlockLu {
 public:
  BlockLu(Eigen::Index points, Eigen::Index size);

  // Sets element (row, column) of all points' matrices; every element must be set before Factor.
  void Set(Eigen::Index row, Eigen::Index column, const Eigen::Ref<const Eigen::ArrayXd>& values);
  void Factor();
  // Replaces each row x_p of `x` (points × size) by A_p⁻¹ x_p.
  void SolveInPlace(Eigen::ArrayXXd& x);

 private:
  using Lanes = Eigen::Array<double, kLanes, 1>;

  Lanes& At(Eigen::Index chunk, Eigen::Index row, Eigen::Index column) {
    return elements_[(chunk * size_ + row) * size_ + column];
  }
  void Pivot(Eigen::Index chunk, Eigen::Index k);
  void SwapRows(Eigen::Index chunk, int lane, Eigen::Index a, Eigen::Index b);

  Eigen::Index size_;
  Eigen::Index chunks_;
  std::vector<Lanes> elements_;   // chunks × rows × columns
  std::vector<int> permutation_;  // chunks × rows × lanes: the row of A that stands there
  std::vector<Lanes> solution_;
};

}  // namespace polyest::internal
