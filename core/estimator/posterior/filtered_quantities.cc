#include "core/estimator/posterior/filtered_quantities.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/chaos/gauss_rule.h"
#include "core/chaos/germ.h"
#include "core/chaos/normal.h"

namespace polyest::internal {
namespace {

constexpr int kNodes = 7;              // of the rule that integrates over each normal distribution
constexpr int kMaxQuantileSteps = 60;  // to find a quantile
// Standard deviations from a mean, beyond which nothing is looked for.
constexpr double kFarthest = 6;
// Error of a quantile, in the width of the mixture.
constexpr double kQuantileError = 1e-10;

// Returns the draws' normal scores of a parameter.
Vector NormalScores(const UncertainParameter& parameter, const Vector& thetas) {
  const Germ germ(parameter.germ);
  Vector scores(thetas.size());
  for (Eigen::Index i = 0; i < thetas.size(); ++i) {
    const double score = germ.NormalScore(parameter.ToGerm(thetas[i]));
    scores[i] = std::clamp(score, -Germ::kMaxScore, Germ::kMaxScore);
  }
  return scores;
}

// A mixture of normal distributions.
struct Mixture {
  Vector mean, deviation, weights;

  struct Below {
    double probability = 0, density = 0;
  };
  Below At(double x) const {
    Below below;
    for (Eigen::Index i = 0; i < mean.size(); ++i) {
      const double distance = x - mean[i];
      if (!(deviation[i] > 0)) {
        below.probability += distance >= 0 ? weights[i] : 0;
        continue;
      }
      const double score = distance / deviation[i];
      below.probability += weights[i] * NormalCdf(score);
      below.density += weights[i] * std::exp(-0.5 * score * score) / deviation[i];
    }
    below.density *= 0.5 * std::numbers::inv_sqrtpi * std::numbers::sqrt2;
    return below;
  }

  // Newton's method, by bisection where a step would leave the bracket.
  double Quantile(double probability) const {
    double lower = (mean - kFarthest * deviation).minCoeff();
    double upper = (mean + kFarthest * deviation).maxCoeff();
    const double error = kQuantileError * (upper - lower);
    double x = lower + 0.5 * (upper - lower);
    for (int step = 0; step < kMaxQuantileSteps && upper - lower > error; ++step) {
      const Below below = At(x);
      (below.probability < probability ? lower : upper) = x;
      const double next = x - (below.probability - probability) / below.density;
      const bool inside = next > lower && next < upper;  // not if the density is 0
      if (inside && std::abs(next - x) <= error) return next;
      x = inside ? next : lower + 0.5 * (upper - lower);
    }
    return x;
  }
};

// Sets mean, standard deviation and limits of f(x) for an increasing f.
template <class Function>
void Summarize(const Mixture& mixture, const Function& f, FilteredQuantity& quantity) {
  const GaussRule rule = MakeGaussRule(Germ::Normal(), kNodes);
  const double origin = f(mixture.weights.dot(mixture.mean));
  double first = 0, second = 0;  // moments about the origin
  for (Eigen::Index i = 0; i < mixture.mean.size(); ++i) {
    if (!(mixture.weights[i] > 0)) continue;
    for (int k = 0; k < kNodes; ++k) {
      const double value = f(mixture.mean[i] + mixture.deviation[i] * rule.nodes[k]) - origin;
      const double weight = mixture.weights[i] * rule.weights[k];
      first += weight * value;
      second += weight * value * value;
    }
  }
  quantity.mean = origin + first;
  quantity.std_dev = std::sqrt(std::max(0.0, second - first * first));
  quantity.lower95 = f(mixture.Quantile(0.025));
  quantity.upper95 = f(mixture.Quantile(0.975));
}

}  // namespace

FilteredDraws DrawFiltered(const ResolvedProblem& problem, const RegionalExpansion& expansion,
                           const PosteriorDraws& posterior) {
  FilteredDraws draws;
  const std::optional<FilteredStates> filtered = expansion.Filtered();
  if (!filtered) return draws;
  const ExpansionDesign& design = expansion.design();
  Matrix phi;
  design.basis->EvaluateMany(design.region.ManyToLocal(posterior.Germs(problem.prior())), phi);
  draws.mean = phi * filtered->mean;
  draws.deviation = (phi * filtered->deviation).cwiseMax(0);
  auto column = std::ssize(problem.problem().model->description().states);
  for (int i = 0; i < problem.dimension(); ++i) {
    const UncertainParameter& parameter = problem.prior().parameters()[static_cast<size_t>(i)];
    if (!parameter.drift) continue;
    draws.mean.col(column++) += NormalScores(parameter, posterior.Parameter(problem.prior(), i));
  }
  return draws;
}

std::vector<FilteredQuantity> DescribeFiltered(const ResolvedProblem& problem,
                                               const FilteredDraws& draws, const Vector& weights) {
  std::vector<FilteredQuantity> all;
  if (draws.mean.cols() == 0) return all;
  const auto mixture = [&](Eigen::Index column) {
    return Mixture{draws.mean.col(column), draws.deviation.col(column), weights};
  };
  Eigen::Index column = 0;
  for (const Quantity& state : problem.problem().model->description().states) {
    all.push_back({.name = state.name, .unit = state.unit});
    Summarize(
        mixture(column++), [](double x) { return x; }, all.back());
  }
  for (int i = 0; i < problem.dimension(); ++i) {
    const UncertainParameter& parameter = problem.prior().parameters()[static_cast<size_t>(i)];
    if (!parameter.drift) continue;
    const Germ germ(parameter.germ);
    all.push_back({.name = parameter.name, .unit = problem.units()[static_cast<size_t>(i)]});
    Summarize(
        mixture(column++),
        [&](double score) { return parameter.ToParameter(germ.OfNormalScore(score)); }, all.back());
  }
  return all;
}

}  // namespace polyest::internal
