#include "core/estimator/record/residual_blocks.h"

#include "core/common/finite_matrix.h"

namespace polyest::internal {
namespace {

// Returns the sum of squares at δ: the quadratic form of (−δ, 1).
double SquareAt(const Matrix& gram, const ConstVectorRef& delta) {
  Vector at(delta.size() + 1);
  at << -delta, 1;
  return at.dot(gram * at);
}

}  // namespace

ResidualBlocks::ResidualBlocks(Eigen::Index unknowns)
    : sum_(Vector::Zero(unknowns + 1)),
      block_(Matrix::Zero(unknowns + 1, unknowns + 1)),
      samples_(block_),
      sums_(block_) {}

void ResidualBlocks::BeginRun() {
  in_block_ = 0;
  sum_.setZero();
  block_.setZero();
}

void ResidualBlocks::Add(const ConstVectorRef& gradient, double residual) {
  const Eigen::Index n = gradient.size();
  sum_.head(n) += gradient;
  sum_[n] += residual;
  block_.topLeftCorner(n, n).noalias() += gradient * gradient.transpose();
  block_.col(n).head(n) += residual * gradient;
  block_.row(n).head(n) += residual * gradient.transpose();
  block_(n, n) += residual * residual;
  if (++in_block_ < kLength) return;
  samples_ += block_;
  sums_.noalias() += sum_ * sum_.transpose();
  ++count_;
  BeginRun();
}

double ResidualBlocks::VarianceRatio(const ConstVectorRef& delta) const {
  return SquareAt(sums_, delta) / SquareAt(samples_, delta);
}

double ResidualBlocks::MeanSquare(const ConstVectorRef& delta) const {
  return SquareAt(samples_, delta) / (kLength * static_cast<double>(count_));
}

bool ResidualBlocks::HasSizesOf(const ResidualBlocks& other) const {
  const Eigen::Index size = other.sum_.size();
  return count_ >= 0 && in_block_ >= 0 && in_block_ < kLength && IsFiniteMatrix(sum_, size) &&
         IsFiniteMatrix(block_, size, size) && IsFiniteMatrix(samples_, size, size) &&
         IsFiniteMatrix(sums_, size, size);
}

}  // namespace polyest::internal
