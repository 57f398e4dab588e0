#include "core/bayes/region.h"

#include <cmath>
#include <utility>

#include "core/common/check.h"

namespace polyest::internal {

Region Region::WholePrior(int dimension) {
  return Region(Vector::Zero(dimension), Matrix::Identity(dimension, dimension));
}

Region::Region(Vector centre, Matrix axes)
    : centre_(std::move(centre)), axes_(std::move(axes)), factors_(axes_) {
  POLYEST_CHECK(axes_.rows() == centre_.size() && axes_.cols() == centre_.size());
  POLYEST_CHECK(std::isfinite(LogVolume()));
}

double Region::LogVolume() const { return factors_.LogAbsDeterminant(); }

Vector Region::ToGerm(const ConstVectorRef& eta) const { return centre_ + axes_ * eta; }

Vector Region::ToLocal(const ConstVectorRef& xi) const {
  return factors_.Solve(Vector(xi - centre_));
}

Matrix Region::ManyToGerm(const ConstMatrixRef& etas) const {
  Matrix xis(etas.rows(), etas.cols());
  xis.noalias() = etas * axes_.transpose();
  xis.rowwise() += centre_.transpose();
  return xis;
}

Matrix Region::ManyToLocal(const ConstMatrixRef& xis) const {
  if (xis.rows() == 0) return Matrix(0, dimension());  // Eigen's solver reads the first column
  return factors_.SolveRows(xis.rowwise() - centre_.transpose());
}

Matrix Region::HessianToGerm(const ConstMatrixRef& hessian) const {
  const Matrix inverse = Inverse(axes_);
  return inverse.transpose() * hessian * inverse;
}

}  // namespace polyest::internal
