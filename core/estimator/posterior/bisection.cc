#include "core/estimator/posterior/bisection.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// The variance of the outputs that the expansion leaves unexplained, as a part of what its terms
// explain, up to which the terms are those of the model.
constexpr double kUnexplained = 0.1;
// The collocation points for each coefficient of a quadratic from which on it leaves residuals.
constexpr Eigen::Index kPointsPerCoefficient = 2;

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

Eigen::Index CoefficientsOfQuadratic(Eigen::Index dimension) {
  return (dimension + 1) * (dimension + 2) / 2;
}

// Whether the terms say on which axis the outputs depend. If the outputs vary too fast for the
// order, least squares spreads them over all terms, and their weights are those of chance.
bool HasTermsOfTheModel(const RegionalExpansion& expansion) {
  const Vector weights = expansion.TermWeights();
  return expansion.OwnError() <= kUnexplained * weights.tail(weights.size() - 1).sum();
}

// Whether a quadratic in the collocation points leaves residuals to look at.
bool HasResidualsOfQuadratic(const RegionalExpansion& expansion) {
  const auto points = std::ssize(expansion.kept_points());
  return points >=
         kPointsPerCoefficient * CoefficientsOfQuadratic(expansion.design().points.cols());
}

// Returns what the quadratic in the points (Q × n) that fits the values best leaves of them.
Vector ResidualsOfQuadratic(const Matrix& points, const Vector& values) {
  const Eigen::Index n = points.cols();
  Matrix terms(points.rows(), CoefficientsOfQuadratic(n));
  terms.col(0).setOnes();
  terms.middleCols(1, n) = points;
  Eigen::Index column = 1 + n;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      terms.col(column++) = points.col(i).cwiseProduct(points.col(j));
    }
  }
  return values - terms * SolveByPivotedQr(terms, values).solution;
}

// Returns the sum of the squared differences of values whose points follow each other on the axis.
double Roughness(const Matrix& points, Eigen::Index axis, const Vector& values) {
  std::vector<Eigen::Index> order(static_cast<size_t>(points.rows()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return points(i, axis); });
  double sum = 0;
  for (size_t i = 1; i < order.size(); ++i) {
    const double step = values[order[i]] - values[order[i - 1]];
    sum += step * step;
  }
  return sum;
}

// Returns the axis on which χ² of the model at the collocation points depends most, apart from what
// a quadratic explains: χ² is one in all that the outputs are linear in. Along that axis the
// residuals vary least from one point to the next (von Neumann's ratio), since as many points
// resolve far more along one axis than a polynomial in all of them.
Eigen::Index AxisOfModel(const RegionalExpansion& expansion) {
  const Matrix points = expansion.design().points(expansion.kept_points(), Eigen::all);
  Vector roughness = Vector::Zero(points.cols());
  for (Eigen::Index c = 0; c < expansion.PointChiSquared().cols(); ++c) {
    const Vector chi_squared = expansion.PointChiSquared()(expansion.kept_points(), c);
    const Vector residuals = ResidualsOfQuadratic(points, chi_squared).normalized();
    if (!residuals.allFinite()) continue;
    for (Eigen::Index j = 0; j < points.cols(); ++j) {
      roughness[j] += Roughness(points, j, residuals);
    }
  }
  Eigen::Index axis = 0;
  roughness.minCoeff(&axis);
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

Eigen::Index AxisToCut(const RegionalExpansion& expansion) {
  if (expansion.absorbed_rows() == 0) return AxisOfFailures(expansion);
  const bool by_terms = HasTermsOfTheModel(expansion) || !HasResidualsOfQuadratic(expansion);
  return by_terms ? AxisOfTerms(expansion) : AxisOfModel(expansion);
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
  const Eigen::Index axis = AxisToCut(expansion);
  // e = axes⁻¹ (ξ − centre): the cut is e_axis = 0.
  const Vector normal = Inverse(whole.axes()).row(axis).transpose();
  auto [below, above] = design.element.Divide(normal, normal.dot(whole.centre()));
  std::vector<Piece> halves;
  halves.push_back({below, Half(whole, axis, -1), ParticlesIn(below, particles), Vector()});
  halves.push_back({above, Half(whole, axis, 1), ParticlesIn(above, particles), Vector()});
  return halves;
}

}  // namespace polyest::internal
