#include "core/estimator/posterior/filtered_quantities.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/chaos/gauss_rule.h"
#include "core/chaos/germ.h"

namespace polyest::internal {
namespace {

constexpr int kNodes = 7;        // of the rule that integrates over each normal distribution
constexpr int kBisections = 60;  // to find a quantile
constexpr double kFarthest =
    6;  // standard deviations from a mean, beyond which nothing is looked for

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

  double ProbabilityBelow(double x) const {
    double below = 0;
    for (Eigen::Index i = 0; i < mean.size(); ++i) {
      const double distance = x - mean[i];
      below += weights[i] * (deviation[i] > 0
                                 ? 0.5 * std::erfc(-distance / (deviation[i] * std::sqrt(2.0)))
                                 : (distance >= 0 ? 1.0 : 0.0));
    }
    return below;
  }

  double Quantile(double probability) const {
    double lower = (mean - kFarthest * deviation).minCoeff();
    double upper = (mean + kFarthest * deviation).maxCoeff();
    for (int step = 0; step < kBisections; ++step) {
      const double middle = lower + 0.5 * (upper - lower);
      (ProbabilityBelow(middle) < probability ? lower : upper) = middle;
    }
    return lower + 0.5 * (upper - lower);
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
