#include "core/estimator/expansion/model_agreement.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/bayes/cost_minima.h"
#include "core/estimator/expansion/search_domain.h"

namespace polyest::internal {
namespace {

constexpr double kMinEffectiveChecks = 2;  // for the spread over them to be meaningful
constexpr double kMaxSpreadOfMean =
    0.25;  // standard deviation of ΔJ at which its mean counts as known
constexpr double kNegligibleWeight = 1e-3;  // weight of a check point relative to the heaviest
// Where residuals are correlated, check points represent the posterior only if the nearest one is
// at most so many standard deviations beyond √n away from its mode.
constexpr double kReachOfChecks = 2;
constexpr double kMaxLag1Correlation = 0.99;

Minimum MinimumOf(const ExpansionDesign& design, const Cost& cost) {
  const Matrix start = design.reference.transpose();
  return FindMinimaOf(cost, SearchOf(cost, design), start, Stop()).front();
}

// Returns √((1 + r)/(1 − r)) with the largest lag-1 correlation r of a channel's residuals at d
// that is more than chance: N independent residuals have one of 2/√N or less, as a rule.
double GainByCorrelation(const RegionalExpansion& expansion, const Vector& d) {
  double largest = 0;
  for (const ChannelSums& sums : expansion.sums()) {
    const double r = sums.Lag1Correlation(d);
    const double chance = 2 / std::sqrt(static_cast<double>(sums.samples.count()));
    if (r > chance) largest = std::max(largest, std::min(r, kMaxLag1Correlation));
  }
  return std::sqrt((1 + largest) / (1 - largest));
}

// What the residuals of the expansion at its check points say of a shift.
struct ShiftOfResiduals {
  double bound = 0;
  bool checks_represent = true;  // whether check points are where the posterior is
};

ShiftOfResiduals BoundByResiduals(const RegionalExpansion& expansion, const Cost& cost,
                                  const CheckDifferences& checks) {
  const auto samples = static_cast<double>(expansion.Checks().samples);
  const double norm = checks.residuals.maxCoeff() * std::sqrt(samples);
  const double of_variances = cost.power() * expansion.LogVarianceError();
  if (!(norm > kNegligibleShift)) return {norm + of_variances, true};  // the rest costs a search
  const Minimum minimum = MinimumOf(expansion.design(), cost);
  const double gain = GainByCorrelation(expansion, cost.BasisDifference(minimum.point));
  if (!(gain > 1)) return {norm + of_variances, true};
  const double nearest = std::sqrt(2 * std::max(0.0, checks.totals.minCoeff() - minimum.value));
  return {gain * norm + of_variances, nearest <= std::sqrt(cost.dimension()) + kReachOfChecks};
}

}  // namespace

double ModelMismatch(const RegionalExpansion& expansion, const ConstVectorRef& d,
                     const ConstVectorRef& chi_squared) {
  double mismatch = 0;
  for (size_t c = 0; c < expansion.sums().size(); ++c) {
    const ChannelSums& sums = expansion.sums()[c];
    const double own = chi_squared[static_cast<Eigen::Index>(c)];
    // Costs two products with a matrix, so only where it counts.
    const double differences =
        sums.correlation_unknown ? 2 * own * (1 - sums.Lag1Correlation(d)) : 0;
    mismatch += NegativeLogLikelihood(sums.Degrees(), own, differences, sums.scale_unknown,
                                      sums.correlation_unknown);
  }
  return mismatch;
}

double LargestShift(const RegionalExpansion& expansion, double power) {
  return std::sqrt(power * expansion.absorbed().OwnError()) +
         power * (expansion.LogVarianceError() + expansion.RoundingError());
}

CheckDifferences DifferencesAtChecks(const RegionalExpansion& expansion, const Cost& cost) {
  const ExpansionDesign& design = expansion.design();
  const RegionalExpansion::Check check = expansion.Checks();
  std::vector<Eigen::Index> rows;
  std::vector<double> totals, log_weights, differences, residuals;
  for (Eigen::Index i = 0; i < design.check_points.rows(); ++i) {
    if (!check.valid[static_cast<size_t>(i)]) continue;
    const Vector eta = design.check_points.row(i).transpose();
    const CostValue value = cost.Evaluate(eta);
    if (!std::isfinite(value.total)) continue;
    rows.push_back(i);
    totals.push_back(value.total);
    log_weights.push_back(design.check_costs[i] - value.total);
    differences.push_back(cost.power() * (ModelMismatch(expansion, cost.BasisDifference(eta),
                                                        check.chi_squared.row(i).transpose()) -
                                          value.mismatch));
    residuals.push_back(std::sqrt(cost.power()) * check.residual_to_noise[i]);
  }
  const auto vector = [](const std::vector<double>& values) {
    return Vector(Eigen::Map<const Vector>(values.data(), std::ssize(values)));
  };
  return {design.check_points(rows, Eigen::all), vector(totals), vector(log_weights),
          vector(differences), vector(residuals)};
}

Agreement AgreementWithModel(const RegionalExpansion& expansion, const Cost& cost) {
  const CheckDifferences checks = DifferencesAtChecks(expansion, cost);
  Agreement agreement;
  if (checks.log_weights.size() == 0) {
    agreement.shift = LargestShift(expansion, cost.power());
    return agreement;
  }
  Vector weights = (checks.log_weights.array() - checks.log_weights.maxCoeff()).exp();
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    if (!(weights[i] > kNegligibleWeight)) continue;
    agreement.residual_to_noise = std::max(agreement.residual_to_noise, checks.residuals[i]);
  }
  weights /= weights.sum();
  const double mean = weights.dot(checks.differences);
  const double spread =
      std::sqrt(weights.dot((checks.differences.array() - mean).square().matrix()));
  const ShiftOfResiduals residuals = BoundByResiduals(expansion, cost, checks);
  agreement.shift = residuals.bound;
  if (residuals.checks_represent && 1 >= kMinEffectiveChecks * weights.squaredNorm()) {
    const double carried = std::sqrt(cost.power() * expansion.CarriedError());
    agreement.shift = std::min(agreement.shift, spread + carried);
    if (spread <= kMaxSpreadOfMean) agreement.mean_difference = mean;
  }
  agreement.shift += cost.power() * expansion.RoundingError();
  return agreement;
}

}  // namespace polyest::internal
