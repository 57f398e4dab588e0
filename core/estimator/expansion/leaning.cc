#include "core/estimator/expansion/leaning.h"

#include <cmath>

#include "core/bayes/cost_minima.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/expansion/search_domain.h"

namespace polyest::internal {
namespace {

constexpr double kTail = 2.2;  // 1.4 % lie beyond so many standard deviations

}  // namespace

bool MayLean(const Cost& cost, const ExpansionDesign& design, const Vector& start) {
  const Minimum minimum =
      FindMinimaOf(cost, SearchOf(cost, design), start.transpose(), Stop()).front();
  const CholeskyFactor cholesky(cost.Hessian(minimum.point));
  const Vector middle = design.Middle(), half = design.HalfWidths();
  const Vector place = (minimum.point - middle).cwiseQuotient(half);
  const auto n = static_cast<Eigen::Index>(cost.dimension());
  for (Eigen::Index j = 0; j < n; ++j) {
    double deviation = kOvershoot;
    if (cholesky.positive_definite()) {
      // (H⁻¹)_jj = ‖L⁻¹ e_j‖²
      deviation = cholesky.SolveLower(Vector(Vector::Unit(n, j))).norm() / half[j];
    }
    if (std::abs(place[j]) + kTail * deviation < kEdge) continue;
    for (const double side : {-1.0, 1.0}) {
      if (side * place[j] + kTail * deviation < kEdge) continue;
      Vector beyond = minimum.point;
      beyond[j] = middle[j] + side * kBeyondEdge * half[j];
      const Vector xi = design.region.ToGerm(beyond);
      if (cost.prior().Contains(xi) && cost.element().Contains(xi)) return true;
    }
  }
  return false;
}

}  // namespace polyest::internal
