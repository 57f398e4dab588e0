#include "core/estimator/posterior/cost_slice.h"

#include <cmath>
#include <utility>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

std::optional<Minimum> At(const Vector& eta, Minimum minimum) {
  if (!std::isfinite(minimum.value)) return std::nullopt;
  minimum.point = eta;
  return minimum;
}

}  // namespace

CostSlice::CostSlice(const MinimizationProblem& search, const Vector& normal)
    : search_(search), a_(normal) {
  const Eigen::Index n = normal.size();
  n_ = OrthonormalBasisFrom(normal).rightCols(n - 1);
  // The rows −η ≤ −lower, η ≤ upper and the search's own rows.
  const Eigen::Index rows = search.constraint.rows();
  rows_.resize(2 * n + rows, n);
  rows_ << -Matrix::Identity(n, n), Matrix::Identity(n, n), search.constraint;
  bounds_.resize(2 * n + rows);
  bounds_ << -search.lower, search.upper, search.bound;
  KeepRowsThatCross();
}

std::optional<Minimum> CostSlice::Minimize(double b, const std::vector<Vector>& starts,
                                           const Stop& stop) const {
  const Vector base = ToSlice(starts.front(), b);
  if (n_.cols() == 0) {
    Minimum only;
    only.value = search_.function(base, nullptr);
    only.converged = true;
    return At(base, std::move(only));
  }
  MinimizationProblem problem;
  problem.function = [&](const Vector& v, Vector* gradient) {
    if (gradient == nullptr) return search_.function(base + n_ * v, nullptr);
    Vector slope(a_.size());
    const double value = search_.function(base + n_ * v, &slope);
    *gradient = n_.transpose() * slope;
    return value;
  };
  const double extent = (search_.upper - search_.lower).norm();
  problem.lower = Vector::Constant(n_.cols(), -extent);
  problem.upper = -problem.lower;
  problem.constraint = rows_ * n_;
  problem.bound = bounds_ - rows_ * base;
  Matrix points(static_cast<Eigen::Index>(starts.size()), n_.cols());
  for (size_t i = 0; i < starts.size(); ++i) {
    points.row(static_cast<Eigen::Index>(i)) = n_.transpose() * (ToSlice(starts[i], b) - base);
  }
  Minimum minimum = FindMinima(problem, points, MinimizerOptions(), stop).front();
  return At(base + n_ * minimum.point, minimum);
}

// Removes rows parallel to the hyperplane: they do not constrain points in it, and rounding would
// give them an arbitrary direction.
void CostSlice::KeepRowsThatCross() {
  constexpr double kParallel = 1e-9;
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < rows_.rows(); ++i) {
    if (!((rows_.row(i) * n_).norm() > kParallel * rows_.row(i).norm())) continue;
    rows_.row(kept) = rows_.row(i).eval();
    bounds_[kept++] = bounds_[i];
  }
  rows_.conservativeResize(kept, rows_.cols());
  bounds_.conservativeResize(kept);
}

// Returns the point of the hyperplane nearest to η.
Vector CostSlice::ToSlice(const Vector& eta, double b) const {
  return eta + a_ * ((b - a_.dot(eta)) / a_.squaredNorm());
}

}  // namespace polyest::internal
