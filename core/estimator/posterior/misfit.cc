#include "core/estimator/posterior/misfit.h"

#include <algorithm>
#include <cmath>

#include "core/estimator/expansion/search_domain.h"

namespace polyest::internal {
namespace {

constexpr double kDeviations = 6;

// Whether the residuals of the channel test its noise: not where the noise is learned from them or
// where large ones count as outliers.
bool IsTested(const ResolvedProblem& problem, size_t channel) {
  const NoiseModel& noise = problem.problem().measured[channel].noise;
  return !noise.unknown && noise.outliers == OutlierHandling::kNone;
}

}  // namespace

double Misfit(const ResolvedProblem& problem, const RegionalExpansion& expansion,
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
  if (!(degrees > 0)) return 1;
  const ExpansionDesign& design = expansion.design();
  const Minimum minimum =
      FindMinima(SearchOf(cost, design), design.reference.transpose(), MinimizerOptions(), stop)
          .front();
  const Vector d = cost.BasisDifference(minimum.point);
  double chi_squared = 0;
  for (size_t c = 0; c < expansion.sums().size(); ++c) {
    if (IsTested(problem, c)) chi_squared += expansion.sums()[c].samples.ChiSquared(d);
  }
  const double excess = chi_squared - degrees;
  return excess > kDeviations * std::sqrt(2 * degrees) ? chi_squared / degrees : 1;
}

}  // namespace polyest::internal
