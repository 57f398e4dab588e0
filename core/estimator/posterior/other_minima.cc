#include "core/estimator/posterior/other_minima.h"

#include <algorithm>
#include <optional>

#include "core/common/linear_algebra.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/cost_slice.h"

namespace polyest::internal {
namespace {

// Other minima count when their density is at least this fraction of the best one's: e^−7 ≈ 10⁻³.
constexpr double kComparableCost = 7;
// An isolated minimum has all curvatures above the prior's; the floor of a valley does not.
constexpr double kIsolatedCurvature = 1;
// By how much the cost must rise between two minima. Where the cost is flat, the expansion has
// ripples that are lower.
constexpr double kRidge = 0.5;
constexpr int kPointsBetween = 15;
constexpr int kSlices = 15;

bool IsIsolated(const Cost& cost, const Region& region, const Prior& prior, const Vector& eta) {
  const Vector unit = prior.GermStandardDeviation();
  const Matrix hessian = region.HessianToGerm(cost.Hessian(eta));
  const Matrix scaled = unit.asDiagonal() * hessian * unit.asDiagonal();
  return SymmetricEigenvalues(scaled).minCoeff() > kIsolatedCurvature;
}

// Returns the greatest cost on the straight way between two points.
double HighestBetween(const Cost& cost, const Vector& from, const Vector& to) {
  double highest = -kInfinity;
  for (int i = 1; i <= kPointsBetween; ++i) {
    const double part = i / (kPointsBetween + 1.0);
    highest = std::max(highest, cost.Evaluate((1 - part) * from + part * to).total);
  }
  return highest;
}

// Whether a valley, straight or curved, leads from one point to the other in which the cost does
// not rise above `most`. Its points are minima of slices across the straight way, each searched
// from the one before.
bool IsValleyBetween(const Cost& cost, const MinimizationProblem& search, const Vector& from,
                     const Vector& to, double most, const Stop& stop) {
  const Vector way = to - from;
  const CostSlice slice(search, way);
  Vector here = from;
  for (int i = 1; i <= kSlices + 1; ++i) {
    Vector next = to;
    if (i <= kSlices) {
      const double offset = way.dot(from) + i / (kSlices + 1.0) * way.squaredNorm();
      const std::optional<Minimum> least = slice.Minimize(offset, {here}, stop);
      if (!least) return false;
      next = least->point;
    }
    if (!(HighestBetween(cost, here, next) <= most)) return false;
    here = next;
  }
  return true;
}

}  // namespace

std::vector<Vector> OtherMinima(const Cost& cost, const ExpansionDesign& design, const Prior& prior,
                                const std::vector<Minimum>& minima, const Stop& stop) {
  const MinimizationProblem search = SearchOf(cost, design);
  const Minimum& best = minima.front();
  std::vector<Vector> others;
  for (size_t i = 1; i < minima.size(); ++i) {
    const Minimum& other = minima[i];
    if (other.value - best.value > kComparableCost || !other.converged) continue;
    const double most = other.value + kRidge;
    if (HighestBetween(cost, best.point, other.point) <= most) continue;
    if (!IsIsolated(cost, design.region, prior, other.point)) continue;
    if (IsValleyBetween(cost, search, best.point, other.point, most, stop)) continue;
    others.push_back(prior.ToParameters(design.region.ToGerm(other.point)));
  }
  return others;
}

}  // namespace polyest::internal
