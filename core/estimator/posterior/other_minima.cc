#include "core/estimator/posterior/other_minima.h"

#include <algorithm>

#include "core/common/linear_algebra.h"

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

bool IsIsolated(const Cost& cost, const Region& region, const Prior& prior, const Vector& eta) {
  const Vector unit = prior.GermStandardDeviation();
  const Matrix hessian = region.HessianToGerm(cost.Hessian(eta));
  const Matrix scaled = unit.asDiagonal() * hessian * unit.asDiagonal();
  return SymmetricEigenvalues(scaled).minCoeff() > kIsolatedCurvature;
}

// Whether the cost rises on the straight way between two minima.
bool AreSeparate(const Cost& cost, const Minimum& one, const Minimum& other) {
  const double higher = std::max(one.value, other.value);
  for (int i = 1; i <= kPointsBetween; ++i) {
    const double part = i / (kPointsBetween + 1.0);
    const Vector between = (1 - part) * one.point + part * other.point;
    if (cost.Evaluate(between).total > higher + kRidge) return true;
  }
  return false;
}

}  // namespace

std::vector<Vector> OtherMinima(const Cost& cost, const ExpansionDesign& design, const Prior& prior,
                                const std::vector<Minimum>& minima) {
  std::vector<Vector> others;
  for (size_t i = 1; i < minima.size(); ++i) {
    if (minima[i].value - minima[0].value > kComparableCost || !minima[i].converged) continue;
    if (!AreSeparate(cost, minima[i], minima[0])) continue;
    if (!IsIsolated(cost, design.region, prior, minima[i].point)) continue;
    others.push_back(prior.ToParameters(design.region.ToGerm(minima[i].point)));
  }
  return others;
}

}  // namespace polyest::internal
