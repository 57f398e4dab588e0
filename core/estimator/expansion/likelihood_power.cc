#include "core/estimator/expansion/likelihood_power.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/bayes/weighted_samples.h"
#include "core/estimator/expansion/model_agreement.h"

namespace polyest::internal {
namespace {

constexpr double kMaxShift = 0.5;  // in standard deviations
constexpr double kMaxSpread = 1;   // of β (J_m − J)
constexpr double kStep = 0.8;      // from one trial of β to the next
constexpr double kMinPower = 1e-12;
// In more dimensions the collocation points are too few to confirm any posterior that is much
// narrower than the region.
constexpr int kMaxDimension = 3;

// What is known at the collocation points.
struct Points {
  Eigen::ArrayXd least;       // min(J_m, J): where either has mass, the difference counts
  Eigen::ArrayXd difference;  // J_m − J
  Eigen::ArrayXd prior;       // −log of the prior's density over that of the points
};

Points PointsOf(const RegionalExpansion& expansion, const Cost& cost) {
  const ExpansionDesign& design = expansion.design();
  std::vector<double> least, difference, prior;
  const Matrix chi_squared_of_points = expansion.absorbed().PointChiSquared();
  for (Eigen::Index q = 0; q < design.points.rows(); ++q) {
    const Vector chi_squared = chi_squared_of_points.row(q).transpose();
    if (!chi_squared.allFinite()) continue;
    const Vector eta = design.points.row(q).transpose();
    const CostValue value = cost.Evaluate(eta);
    const double model = ModelMismatch(expansion, cost.BasisDifference(eta), chi_squared);
    if (!std::isfinite(value.mismatch) || !std::isfinite(model)) continue;
    least.push_back(std::min(model, value.mismatch));
    difference.push_back(model - value.mismatch);
    // The points of the whole prior are draws of it.
    prior.push_back(design.whole_prior ? 0 : cost.regularization() * value.prior);
  }
  const auto array = [](const std::vector<double>& values) {
    return Eigen::ArrayXd(Eigen::Map<const Eigen::ArrayXd>(values.data(), std::ssize(values)));
  };
  return {array(least), array(difference), array(prior)};
}

// Whether the posterior tempered by β is confirmed by the points.
bool Confirmed(const Points& points, double beta, double inflation, double effective) {
  const Eigen::ArrayXd costs = beta * points.least + points.prior;
  const Eigen::ArrayXd weights = (costs.minCoeff() - costs).exp();
  const double sum = weights.sum();
  if (EffectiveSizeOfWeights(weights.matrix()) < effective) return false;
  const double mean = (weights * points.difference).sum() / sum;
  const double variance = (weights * (points.difference - mean).square()).sum() / sum;
  return beta * inflation * std::sqrt(variance) <= kMaxSpread;
}

}  // namespace

double PowerOfFirstSamples(const ResolvedProblem& problem, int64_t rows) {
  if (problem.dimension() <= kFewDimensions) return 1;
  const auto samples = static_cast<double>(rows * problem.channels());
  return std::min(1.0, samples / (2 * (problem.dimension() + 2.0)));
}

double LikelihoodPower(const RegionalExpansion& expansion, const Cost& cost) {
  if (LargestShift(expansion, cost.power()) <= kMaxShift) return cost.power();
  if (expansion.design().checks_are_draws &&
      AgreementWithModel(expansion, cost).shift <= kMaxShift) {
    return cost.power();
  }
  if (cost.dimension() > kMaxDimension) return cost.power();
  const Points points = PointsOf(expansion, cost);
  if (points.least.size() == 0) return cost.power();
  const auto count = static_cast<double>(points.least.size());
  // The fit has used up S of the Q points' differences.
  const double left = count - expansion.design().basis->size();
  const double inflation = left > 0 ? std::sqrt(count / left) : 2;
  const double effective = std::min(cost.dimension() + 2.0, 0.5 * count);
  double beta = cost.power();
  while (beta > kMinPower && !Confirmed(points, beta, inflation, effective)) beta *= kStep;
  return beta;
}

double BelievedShift(const RegionalExpansion& expansion, const Cost& cost, bool in_element) {
  const bool believed =
      expansion.design().checks_are_draws || (!in_element && !(expansion.LogVarianceError() > 0));
  return believed ? AgreementWithModel(expansion, cost).shift
                  : LargestShift(expansion, cost.power());
}

}  // namespace polyest::internal
