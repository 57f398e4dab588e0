#include "core/estimator/posterior/misfit.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/cost_minima.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/expansion/search_domain.h"

namespace polyest::internal {
namespace {

constexpr double kDeviations = 6;
// Part of the excess of χ² that the prior alone must explain to be what is wrong.
constexpr double kMostlyPrior = 0.5;

// Whether the residuals of the channel test its noise: not where the noise is learned from them or
// where large ones count as outliers.
bool IsTested(const ResolvedProblem& problem, size_t channel) {
  const NoiseModel& noise = problem.problem().measured[channel].noise;
  return !noise.unknown && noise.outliers == OutlierHandling::kNone;
}

// Returns two starts for the minimizer: the region's reference, and the collocation point of least
// cost, since the reference may be a stationary point that is no minimum, such as v = 0 for the
// output v².
Matrix StartsOf(const Cost& cost, const ExpansionDesign& design) {
  Vector costs;
  cost.EvaluateMany(design.points, costs);
  Eigen::Index least = 0;
  for (Eigen::Index q = 1; q < costs.size(); ++q) {
    if (costs[q] < costs[least]) least = q;
  }
  Matrix starts(2, design.reference.size());
  starts.row(0) = design.reference.transpose();
  starts.row(1) = design.points.row(least);
  return starts;
}

// Returns by how much χ² would fall, to second order, if the prior let the parameters go: gᵀ H⁻¹ g
// with the gradient g of J_apriori and the Hessian H of the mismatch.
double HeldByPrior(const RegionalExpansion& expansion, const Cost& cost, const Vector& eta) {
  Cost without_prior = expansion.MakeCost(0);
  without_prior.set_power(1);
  Vector both(eta.size()), mismatch(eta.size());
  cost.EvaluateWithGradient(eta, both);
  without_prior.EvaluateWithGradient(eta, mismatch);
  const CholeskyFactor hessian(cost.MismatchHessian(eta));
  if (!hessian.positive_definite()) return 0;
  const double held = hessian.SolveLower(both - mismatch).squaredNorm();
  return std::isfinite(held) ? held : 0;
}

}  // namespace

MisfitFound FindMisfit(const ResolvedProblem& problem, const RegionalExpansion& expansion,
                       const Stop& stop) {
  // A prior of more weight, because it is regularized or the likelihood tempered, would keep the
  // minimum away from where the samples are.
  Cost cost = expansion.MakeCost(std::min(1.0, problem.problem().regularization));
  cost.set_power(1);
  double degrees = 0;
  for (size_t c = 0; c < expansion.sums().size(); ++c) {
    if (!IsTested(problem, c)) continue;
    // Where the expansion's own error has been added to the noise, χ² is smaller by the discount.
    degrees += expansion.sums()[c].Degrees() - expansion.Discount(static_cast<int>(c));
  }
  if (!(degrees > 0)) return {};
  const ExpansionDesign& design = expansion.design();
  const Minimum minimum =
      FindMinimaOf(cost, SearchOf(cost, design), StartsOf(cost, design), stop).front();
  const Vector d = cost.BasisDifference(minimum.point);
  double chi_squared = 0;
  for (size_t c = 0; c < expansion.sums().size(); ++c) {
    if (IsTested(problem, c))
      chi_squared += expansion.absorbed().ChiSquaredAt(static_cast<int>(c), d);
  }
  const double excess = chi_squared - degrees;
  if (!(excess > kDeviations * std::sqrt(2 * degrees))) return {};
  if (HeldByPrior(expansion, cost, minimum.point) > kMostlyPrior * excess) return {};
  const Matrix point = minimum.point.transpose();
  return {chi_squared / degrees,
          !LeaningAxes(design, problem.prior(), cost.element(), point).empty()};
}

}  // namespace polyest::internal
