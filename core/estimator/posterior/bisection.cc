#include "core/estimator/posterior/bisection.h"

#include <utility>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// Returns the axis on which the terms of the two highest degrees depend most: each counts by its
// weight and the share of its degree that belongs to the axis. Two degrees, because those of one
// parity vanish if the model is even or odd.
Eigen::Index AxisToCut(const Basis& basis, const Vector& weights) {
  const Eigen::ArrayXXi& indices = basis.indices();
  Vector share = Vector::Zero(indices.cols());
  for (Eigen::Index s = 0; s < indices.rows(); ++s) {
    if (indices.row(s).sum() < basis.order() - 1) continue;
    share += weights[s] * indices.row(s).cast<double>().matrix().transpose();
  }
  Eigen::Index axis = 0;
  share.maxCoeff(&axis);
  return axis;
}

// Returns the axis on which the collocation points whose trajectories have failed differ most in
// the mean from the others, in units of the region.
Eigen::Index AxisOfFailures(const RegionalExpansion& expansion) {
  const Matrix& points = expansion.design().points;
  const std::vector<int>& kept = expansion.kept_points();
  Eigen::Index axis = 0;
  if (kept.empty()) return axis;
  const Vector mean = points(kept, Eigen::all).colwise().mean().transpose();
  const Vector half = 0.5 * (expansion.design().upper - expansion.design().lower);
  (mean - points.colwise().mean().transpose()).cwiseQuotient(half).cwiseAbs().maxCoeff(&axis);
  return axis;
}

// Returns the half of the region on one side, −1 or 1, of the middle of its axis.
Region Half(const Region& whole, Eigen::Index axis, int side) {
  Vector centre = whole.centre() + 0.5 * side * whole.axes().col(axis);
  Matrix axes = whole.axes();
  axes.col(axis) *= 0.5;
  return Region(std::move(centre), std::move(axes));
}

Matrix ParticlesIn(const Element& element, const Matrix& particles) {
  std::vector<Eigen::Index> inside;
  for (Eigen::Index i = 0; i < particles.rows(); ++i) {
    if (element.Contains(particles.row(i).transpose())) inside.push_back(i);
  }
  return particles(inside, Eigen::all);
}

}  // namespace

std::vector<Piece> Bisect(const RegionalExpansion& expansion, const Matrix& particles) {
  const ExpansionDesign& design = expansion.design();
  const Region whole = TrustedRegion(design);
  const Eigen::Index axis = expansion.absorbed_rows() > 0
                                ? AxisToCut(*design.basis, expansion.TermWeights())
                                : AxisOfFailures(expansion);
  // e = axes⁻¹ (ξ − centre): the cut is e_axis = 0.
  const Vector normal = Inverse(whole.axes()).row(axis).transpose();
  auto [below, above] = design.element.Divide(normal, normal.dot(whole.centre()));
  std::vector<Piece> halves;
  halves.push_back({below, Half(whole, axis, -1), ParticlesIn(below, particles), Vector()});
  halves.push_back({above, Half(whole, axis, 1), ParticlesIn(above, particles), Vector()});
  return halves;
}

}  // namespace polyest::internal
