#pragma once

// LU factors of one small dense matrix a point, kLanes points at a time:
//
//   P_p A_p = L_p U_p, partial pivoting for each point on its own.
//
// A matrix that is singular gives a solution that is not finite.

#include <Eigen/Core>
#include <vector>

#include "core/common/types.h"

namespace polyest {

class BlockLu {
 public:
  BlockLu(Eigen::Index points, Eigen::Index size);

  // Element (row, column) of all points' matrices, to be set before Factor.
  void Set(Eigen::Index row, Eigen::Index column, const Eigen::Ref<const Eigen::ArrayXd>& values);
  void Factor();
  // x_p = A_p⁻¹ x_p for each point; points × size.
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

}  // namespace polyest
