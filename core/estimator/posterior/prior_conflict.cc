#include "core/estimator/posterior/prior_conflict.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/chi_squared.h"
#include "core/bayes/weighted_samples.h"

namespace polyest::internal {
namespace {

// The part of a prior's variance that the data must have taken away, for its place to say anything.
constexpr double kMinInformed = 0.1;

// Returns log ρ at its maximum − log ρ(x), the logarithms of the germ's density.
double BelowMaximum(const Germ& germ, double x) {
  return germ.LogDensity(germ.Mode()) - germ.LogDensity(x);
}

}  // namespace

PriorConflict FindPriorConflict(const ResolvedProblem& problem, const PosteriorDraws& posterior,
                                double regularization) {
  const Prior& prior = problem.prior();
  const Matrix xis = posterior.Germs(prior);
  const Vector deviation = prior.GermStandardDeviation();
  PriorConflict found{Vector::Zero(prior.dimension())};
  double sum = 0;
  for (int i = 0; i < prior.dimension(); ++i) {
    const UncertainParameter& parameter = prior.parameters()[static_cast<size_t>(i)];
    if (parameter.population) continue;
    const Vector z = posterior.scores.col(i);
    const double contraction = WeightedStandardDeviation(z, posterior.weights) / deviation[i];
    const double informed = 1 - contraction * contraction;
    const double x = prior.MarginalGerm(i, WeightedMean(z, posterior.weights));
    if (informed > kMinInformed) {
      found.of_parameters[i] =
          std::sqrt(2 * regularization * BelowMaximum(Germ(parameter.germ), x) / informed);
    }
    sum += BelowMaximum(prior.germs()[static_cast<size_t>(i)],
                        WeightedMean(xis.col(i), posterior.weights));
  }
  found.of_all = NormalDeviateOfChiSquared(2 * regularization * sum, prior.dimension());
  return found;
}

}  // namespace polyest::internal
