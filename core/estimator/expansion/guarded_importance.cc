#include "core/estimator/expansion/guarded_importance.h"

#include <algorithm>
#include <random>
#include <utility>

#include "core/bayes/differential_evolution.h"
#include "core/bayes/mixture_importance.h"
#include "core/bayes/pareto_tail.h"
#include "core/bayes/weighted_samples.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/expansion/mode_search.h"

namespace polyest::internal {
namespace {

constexpr double kMinEffective = 0.5;
constexpr double kHeaviest = 0.01;
// Several Gaussians have so many points for each of a single one, and may be adapted so often.
constexpr int kPointsOfModes = 4, kAdaptations = 5;
// Least effective size of draws of several Gaussians from which chains may start, and the heaviest
// weight.
constexpr double kMinRough = 500, kHeaviestRough = 0.03;
// The part of the guesses that may lie out of their reach, in the tails of a mode, at most.
constexpr double kMaxBeyond = 0.01;

// Whether the effective size and the heaviest weight are those of draws that can be trusted.
bool IsEven(const WeightedDraws& draws, int points) {
  return !(draws.effective_size < kMinEffective * points || draws.weights.maxCoeff() > kHeaviest);
}

bool IsReliable(const WeightedDraws& draws, int points) {
  if (!IsEven(draws, points)) return false;
  const std::optional<double> shape = TailShape(draws.weights.array().log());
  return !shape || *shape <= kMaxTrustedShape;
}

// Draws from the Gaussian at the only minimum, if it is one.
void DrawFromOnlyMode(const Cost& cost, const ModeSearch& search, int points,
                      GuardedDraws& result) {
  const std::optional<Matrix> factor = search.FactorOfOnlyMode();
  if (!factor) return;
  WeightedDraws drawn = ImportanceSample(cost, search.lower(), search.upper(),
                                         search.minima().front().point, *factor, points);
  if (IsEven(drawn, points)) result.draws = std::move(drawn);
}

// Draws from a mixture of Gaussians at the minima, where there are several.
void DrawFromModes(const Cost& cost, int points, const Stop& stop, ModeSearch& search,
                   GuardedDraws& result) {
  std::optional<std::vector<GaussianMode>> modes = search.FindModes();
  if (!modes) return;
  double best = kMinRough;
  for (int i = 0; i <= kAdaptations && stop.Check().ok(); ++i) {
    WeightedDraws drawn =
        ImportanceSample(cost, search.lower(), search.upper(), *modes, kPointsOfModes * points);
    if (!(drawn.effective_size > 0)) return;
    const std::vector<GaussianMode> used = *std::exchange(modes, AdaptedTo(drawn, *modes));
    if (!search.Reach({used.begin(), used.end() - 1}, kMaxBeyond)) continue;
    if (IsReliable(drawn, points)) {
      result.draws = std::move(drawn);
      result.rough.reset();
      return;
    }
    if (drawn.effective_size < best || drawn.weights.maxCoeff() > kHeaviestRough) continue;
    best = drawn.effective_size;
    result.rough = std::move(drawn);
  }
}

}  // namespace

Particles Resampled(const WeightedDraws& draws, int count, uint64_t seed) {
  std::vector<Eigen::Index> rows = EquallyWeighted(draws.weights, count);
  std::mt19937_64 generator(seed);
  Shuffle(rows, generator);
  return {draws.etas(rows, Eigen::all), draws.costs(rows)};
}

GuardedDraws DrawIfNearlyGaussian(const Cost& cost, const ExpansionDesign& design,
                                  const Matrix& guesses, int points, const Stop& stop) {
  ModeSearch search(cost, design, guesses, stop);
  GuardedDraws result;
  if (stop.Check().ok()) {
    if (search.CountOfMinima() > 1 && cost.dimension() > kFewDimensions) {
      DrawFromModes(cost, points, stop, search, result);
    } else {
      DrawFromOnlyMode(cost, search, points, result);
    }
  }
  result.minima = search.minima();
  return result;
}

}  // namespace polyest::internal
