#include "core/bayes/unit_problem.h"

#include <algorithm>
#include <cmath>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr int kMaxSweeps = 2000;
constexpr double kProjected = 1e-14;

}  // namespace

UnitProblem::UnitProblem(const MinimizationProblem& problem, const Stop& stop)
    : problem_(problem), stop_(stop), width_(problem.upper - problem.lower) {
  POLYEST_CHECK(width_.allFinite() && width_.minCoeff() >= 0);
  POLYEST_CHECK(problem.constraint.rows() == problem.bound.size());
  // The rows are a (lower + W u) ≤ bound, divided by the length of a W.
  const Eigen::Index n = width_.size();
  rows_.resize(problem.constraint.rows(), n);
  bounds_.resize(problem.constraint.rows());
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < problem.constraint.rows(); ++i) {
    const Vector row = problem.constraint.row(i).transpose().cwiseProduct(width_);
    const double length = row.norm();
    if (!(length > 0)) continue;
    rows_.row(kept) = row.transpose() / length;
    bounds_[kept++] = (problem.bound[i] - problem.constraint.row(i).dot(problem.lower)) / length;
  }
  rows_.conservativeResize(kept, n);
  bounds_.conservativeResize(kept);
}

Vector UnitProblem::ToPoint(const Vector& u) const {
  const Vector x = problem_.lower + width_.cwiseProduct(u);
  return x.cwiseMax(problem_.lower).cwiseMin(problem_.upper);
}

Vector UnitProblem::ToUnit(const Vector& x) const {
  Vector u(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    u[i] = width_[i] > 0 ? (x[i] - problem_.lower[i]) / width_[i] : 0;
    if (!std::isfinite(u[i])) u[i] = 0.5;
  }
  return u;
}

double UnitProblem::Value(const Vector& u, Vector* gradient) {
  ++evaluations_;
  Vector slope = Vector::Zero(u.size());  // a function that is infinite may leave it alone
  double value = problem_.function(ToPoint(u), gradient == nullptr ? nullptr : &slope);
  value /= function_scale_;
  if (gradient != nullptr) {
    *gradient = slope.cwiseProduct(width_) / function_scale_;
    if (!gradient->allFinite() || !std::isfinite(value)) {
      gradient->setZero();
      return kInfinity;
    }
  }
  return std::isfinite(value) ? value : kInfinity;
}

Vector UnitProblem::Project(Vector u) const {
  u = u.cwiseMax(0).cwiseMin(1);
  if (MaxViolated(u) <= 0) return u;
  Matrix correction = Matrix::Zero(u.size(), rows_.rows() + 1);
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    const Vector before = u;
    for (Eigen::Index i = 0; i < rows_.rows(); ++i) {
      const Vector from = u + correction.col(i);
      const double excess = rows_.row(i).dot(from) - bounds_[i];
      u = from - std::max(0.0, excess) * rows_.row(i).transpose();
      correction.col(i) = from - u;
    }
    const Vector from = u + correction.rightCols<1>();
    u = from.cwiseMax(0).cwiseMin(1);
    correction.rightCols<1>() = from - u;
    if ((u - before).cwiseAbs().maxCoeff() < kProjected && MaxViolated(u) < kProjected) break;
  }
  return u;
}

double UnitProblem::MaxViolated(const Vector& u) const {
  return rows_.rows() == 0 ? 0 : (rows_ * u - bounds_).maxCoeff();
}

}  // namespace polyest::internal
