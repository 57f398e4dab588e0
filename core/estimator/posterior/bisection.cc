#include "core/estimator/posterior/bisection.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// The variance of the outputs that the expansion leaves unexplained, as a part of what its terms
// explain, up to which the terms are those of the model.
constexpr double kUnexplained = 0.1;

// Returns the axis on which the terms of the two highest degrees depend most: each counts by its
// weight and the share of its degree that belongs to the axis. Two degrees, because those of one
// parity vanish if the model is even or odd.
Eigen::Index AxisOfTerms(const RegionalExpansion& expansion) {
  const Basis& basis = *expansion.design().basis;
  const Vector weights = expansion.TermWeights();
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
  const Vector half = expansion.design().HalfWidths();
  (mean - points.colwise().mean().transpose()).cwiseQuotient(half).cwiseAbs().maxCoeff(&axis);
  return axis;
}

// Returns a region that covers the half of `whole` on one side, −1 or 1, of the cut
// normalᵀ(ξ − centre) = 0. All axes but one are sheared until they lie in the cut; that one goes
// halfway from the cut to the farthest point of the half.
Region Half(const Region& whole, const Vector& normal, int side) {
  const Vector across = whole.axes().transpose() * normal;
  Eigen::Index most = 0;
  across.cwiseAbs().maxCoeff(&most);
  const Vector way = whole.axes().col(most) / across[most];  // normalᵀ way = 1
  Matrix axes = whole.axes() - way * across.transpose();
  axes.col(most) = 0.5 * across.cwiseAbs().sum() * way;
  Vector centre = whole.centre() + side * axes.col(most);
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

bool HasTermsOfTheModel(const RegionalExpansion& expansion) {
  const Vector weights = expansion.TermWeights();
  return expansion.absorbed().OwnError() <= kUnexplained * weights.tail(weights.size() - 1).sum();
}

std::vector<Piece> Bisect(const RegionalExpansion& expansion, std::optional<Eigen::Index> germ,
                          const Matrix& particles) {
  const ExpansionDesign& design = expansion.design();
  const Region whole = TrustedRegion(design);
  Vector normal;
  if (germ) {
    normal = Vector::Unit(design.points.cols(), *germ);
  } else {
    const bool fails = expansion.absorbed_rows() == 0;
    const Eigen::Index axis = fails ? AxisOfFailures(expansion) : AxisOfTerms(expansion);
    // e = axes⁻¹ (ξ − centre): the cut is e_axis = 0.
    normal = Inverse(whole.axes()).row(axis).transpose();
  }
  auto [below, above] = design.element.Divide(normal, normal.dot(whole.centre()));
  std::vector<Piece> halves;
  halves.push_back({below, Half(whole, normal, -1), ParticlesIn(below, particles), Vector()});
  halves.push_back({above, Half(whole, normal, 1), ParticlesIn(above, particles), Vector()});
  return halves;
}

}  // namespace polyest::internal
