#include "core/estimator/expansion/settlement_particles.h"

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "core/bayes/weighted_samples.h"
#include "core/common/status.h"
#include "core/estimator/expansion/guarded_importance.h"

namespace polyest::internal {
namespace {

// Importance sampling's points: so many for each parameter, and at most.
constexpr int kPointsPerParameter = 2048, kMaxImportancePoints = 4096;

// Resamples systematically, then shuffles: the first particles become check points, and the order
// of quasi-random points is anything but random.
Particles Resample(const WeightedDraws& draws, int count, uint64_t seed) {
  std::vector<Eigen::Index> rows = EquallyWeighted(draws.weights, count);
  std::mt19937_64 generator(seed);
  for (size_t i = rows.size() - 1; i > 0; --i) {
    std::swap(rows[i], rows[static_cast<size_t>(generator() % (i + 1))]);
  }
  return {draws.etas(rows, Eigen::all), draws.costs(rows)};
}

}  // namespace

absl::StatusOr<Particles> SampleForSettlement(const Cost& cost, const ExpansionDesign& design,
                                              const Matrix& guesses, uint64_t seed,
                                              const Stop& stop) {
  SamplerOptions options;
  options.seed = seed;
  const Matrix local = design.region.ManyToLocal(guesses);
  const int points = std::min(kMaxImportancePoints, kPointsPerParameter * cost.dimension());
  const GuardedDraws drawn = DrawIfNearlyGaussian(cost, design, local, points, stop);
  POLYEST_RETURN_IF_ERROR(stop.Check());
  if (drawn.draws) return Resample(*drawn.draws, options.particles, seed);
  Vector lower, upper;
  SamplingBox(design, lower, upper);
  return SamplePosterior(cost, lower, upper, local, options, stop);
}

}  // namespace polyest::internal
