#include "core/propagation/block_lu.h"

#include <cmath>
#include <utility>

namespace polyest::internal {

BlockLu::BlockLu(Eigen::Index points, Eigen::Index size)
    : size_(size),
      chunks_(points / kLanes),
      elements_(chunks_ * size * size, Lanes::Zero()),
      permutation_(chunks_ * size * kLanes),
      solution_(size) {}

void BlockLu::Set(Eigen::Index row, Eigen::Index column,
                  const Eigen::Ref<const Eigen::ArrayXd>& values) {
  for (Eigen::Index chunk = 0; chunk < chunks_; ++chunk) {
    At(chunk, row, column) = values.segment<kLanes>(chunk * kLanes);
  }
}

void BlockLu::SwapRows(Eigen::Index chunk, int lane, Eigen::Index a, Eigen::Index b) {
  for (Eigen::Index j = 0; j < size_; ++j) {
    std::swap(At(chunk, a, j)(lane), At(chunk, b, j)(lane));
  }
  int* const permutation = permutation_.data() + chunk * size_ * kLanes + lane;
  std::swap(permutation[a * kLanes], permutation[b * kLanes]);
}

void BlockLu::Pivot(Eigen::Index chunk, Eigen::Index k) {
  for (int lane = 0; lane < kLanes; ++lane) {
    Eigen::Index best = k;
    for (Eigen::Index i = k + 1; i < size_; ++i) {
      if (std::abs(At(chunk, i, k)(lane)) > std::abs(At(chunk, best, k)(lane))) best = i;
    }
    if (best != k) SwapRows(chunk, lane, k, best);
  }
}

void BlockLu::Factor() {
  for (Eigen::Index chunk = 0; chunk < chunks_; ++chunk) {
    for (Eigen::Index i = 0; i < size_; ++i) {
      for (int lane = 0; lane < kLanes; ++lane) {
        permutation_[(chunk * size_ + i) * kLanes + lane] = static_cast<int>(i);
      }
    }
    for (Eigen::Index k = 0; k < size_; ++k) {
      Pivot(chunk, k);
      const Lanes inverse_pivot = At(chunk, k, k).inverse();
      for (Eigen::Index i = k + 1; i < size_; ++i) {
        // l_ik = a_ik/u_kk;  a_ij −= l_ik u_kj
        const Lanes factor = At(chunk, i, k) * inverse_pivot;
        At(chunk, i, k) = factor;
        for (Eigen::Index j = k + 1; j < size_; ++j) At(chunk, i, j) -= factor * At(chunk, k, j);
      }
      At(chunk, k, k) = inverse_pivot;  // only the inverse of u_kk is needed
    }
  }
}

void BlockLu::SolveInPlace(Eigen::ArrayXXd& x) {
  for (Eigen::Index chunk = 0; chunk < chunks_; ++chunk) {
    for (Eigen::Index i = 0; i < size_; ++i) {
      for (int lane = 0; lane < kLanes; ++lane) {
        solution_[i](lane) =
            x(chunk * kLanes + lane, permutation_[(chunk * size_ + i) * kLanes + lane]);
      }
      // L y = P b
      for (Eigen::Index j = 0; j < i; ++j) solution_[i] -= At(chunk, i, j) * solution_[j];
    }
    for (Eigen::Index i = size_ - 1; i >= 0; --i) {
      // U x = y
      for (Eigen::Index j = i + 1; j < size_; ++j) solution_[i] -= At(chunk, i, j) * solution_[j];
      solution_[i] *= At(chunk, i, i);
      x.col(i).segment<kLanes>(chunk * kLanes) = solution_[i];
    }
  }
}

}  // namespace polyest::internal
