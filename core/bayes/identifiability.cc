#include "core/bayes/identifiability.h"

#include <algorithm>
#include <cmath>

#include "core/common/check.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// The difference up to which coefficients count as equal when a direction's sign is chosen.
constexpr double kSameSize = 1e-9;

Vector WithPositiveLargest(Vector direction) {
  const double largest = direction.cwiseAbs().maxCoeff();
  for (const double coefficient : direction) {
    if (std::abs(coefficient) < largest - kSameSize) continue;
    if (coefficient < 0) direction = -direction;
    break;
  }
  return direction;
}

Verdict VerdictOfInformation(double information) {
  if (information >= kIdentifiedInformation) return Verdict::kIdentified;
  return information < kWeakInformation ? Verdict::kNotIdentified : Verdict::kWeak;
}

}  // namespace

std::vector<Direction> Directions(const ConstMatrixRef& mismatch_hessian, const Prior& prior) {
  POLYEST_CHECK(mismatch_hessian.allFinite());
  // Lᵀ H_mismatch L, L = diag(prior standard deviations of ξ)
  const Vector deviation = prior.GermStandardDeviation();
  const Matrix scaled = deviation.asDiagonal() * mismatch_hessian * deviation.asDiagonal();
  const SymmetricEigen eigen = DecomposeSymmetric((scaled + scaled.transpose()) / 2);
  std::vector<Direction> directions;
  for (Eigen::Index i = scaled.rows() - 1; i >= 0; --i) {  // eigenvalues come in increasing order
    Direction direction;
    direction.information = std::max(0.0, eigen.values[i]);
    // The scores move by F v for a step v of the scaled germs (D⁻¹ F D = F, since D is 1 where F is
    // not the identity).
    Vector coefficients = eigen.vectors.col(i);
    if (prior.correlated()) coefficients = prior.ToScores(coefficients).normalized();
    direction.coefficients = WithPositiveLargest(std::move(coefficients));
    direction.verdict = VerdictOfInformation(direction.information);
    directions.push_back(std::move(direction));
  }
  return directions;
}

Verdict VerdictOfContraction(double contraction) {
  if (contraction <= kIdentifiedContraction) return Verdict::kIdentified;
  return contraction >= kNotIdentifiedContraction ? Verdict::kNotIdentified : Verdict::kWeak;
}

}  // namespace polyest::internal
