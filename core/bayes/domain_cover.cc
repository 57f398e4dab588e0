#include "core/bayes/domain_cover.h"

#include <algorithm>
#include <cmath>

#include "core/chaos/collocation_points.h"
#include "core/common/golden_fraction.h"

namespace polyest::internal {
namespace {

constexpr double kJustInDomain = 1 - 1e-12;  // keeps rounding from putting a point outside Ω
constexpr double kOffBounds = 0.01;          // of Ω's width, for a point moved into Ω

bool IsDiagonal(const Matrix& matrix) {
  return (matrix - Matrix(matrix.diagonal().asDiagonal())).isZero(0);
}

// Narrows the box to Ω, whose faces are parallel to the box's.
void Intersect(const Region& region, const Prior& prior, Vector& lower, Vector& upper) {
  for (Eigen::Index j = 0; j < lower.size(); ++j) {
    const double axis = region.axes()(j, j), centre = region.centre()[j];
    const double first = (prior.lower()[j] - centre) / axis;
    const double second = (prior.upper()[j] - centre) / axis;
    const double low = std::max(lower[j], std::min(first, second));
    const double high = std::min(upper[j], std::max(first, second));
    if (!(low < high)) continue;  // they do not overlap: the points are moved one by one
    lower[j] = low;
    upper[j] = high;
  }
}

// Returns the point of Ω towards which points outside are moved, in germ coordinates.
Vector PointInside(const Region& region, const Prior& prior, const Vector& lower,
                   const Vector& upper, const Matrix& guesses) {
  Vector sum = Vector::Zero(prior.dimension());
  int count = 0;
  for (Eigen::Index i = 0; i < guesses.rows(); ++i) {
    const Vector eta = guesses.row(i).transpose();
    if ((eta.array() < lower.array()).any() || (eta.array() > upper.array()).any()) continue;
    const Vector xi = region.ToGerm(eta);
    if (!prior.Contains(xi)) continue;
    sum += xi;
    ++count;
  }
  if (count > 0) return sum / count;
  Vector inside = region.ToGerm(0.5 * (lower + upper));
  for (int j = 0; j < prior.dimension(); ++j) {
    const double low = prior.lower()[j], high = prior.upper()[j];
    const double off = std::isfinite(high - low) ? kOffBounds * (high - low) : kOffBounds;
    inside[j] = std::min(std::max(inside[j], low + off), high - off);
  }
  return inside;
}

}  // namespace

double FractionInDomain(const Prior& prior, const Vector& xi, const Vector& inside) {
  double fraction = 1;
  for (Eigen::Index j = 0; j < xi.size(); ++j) {
    const double step = xi[j] - inside[j];
    if (xi[j] > prior.upper()[j]) {
      fraction = std::min(fraction, (prior.upper()[j] - inside[j]) / step);
    } else if (xi[j] < prior.lower()[j]) {
      fraction = std::min(fraction, (prior.lower()[j] - inside[j]) / step);
    }
  }
  return fraction;
}

Matrix CoverOfDomain(const Region& region, const Prior& prior, const Vector& lower,
                     const Vector& upper, const Matrix& guesses, int count) {
  const int n = region.dimension();
  Vector low = lower, high = upper;
  if (IsDiagonal(region.axes())) Intersect(region, prior, low, high);
  Matrix cover = UnitCubePoints(PointSet::kHalton, n, count) * (high - low).asDiagonal();
  cover.rowwise() += low.transpose();
  const Vector inside = PointInside(region, prior, lower, upper, guesses);
  const Vector local = region.ToLocal(inside);
  double uniform = 0;
  const Matrix xis = region.ManyToGerm(cover).transpose();
  for (Eigen::Index i = 0; i < cover.rows(); ++i) {
    if (prior.Contains(xis.col(i))) continue;
    const Vector xi = xis.col(i);
    // With s = U^{1/n}, evenly distributed U, the points on a ray are as dense as in the volume.
    uniform = std::fmod(uniform + kGoldenFraction, 1);
    const double fraction =
        kJustInDomain * FractionInDomain(prior, xi, inside) * std::pow(uniform, 1.0 / n);
    cover.row(i) = local.transpose() + fraction * (cover.row(i) - local.transpose());
  }
  return cover;
}

}  // namespace polyest::internal
