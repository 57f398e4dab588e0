#include "core/estimator/expansion/reexpansion_particles.h"

#include <algorithm>

#include "core/bayes/differential_evolution.h"
#include "core/common/status.h"
#include "core/estimator/expansion/guarded_importance.h"

namespace polyest::internal {
namespace {

// Importance sampling's points: so many for each parameter, and at most.
constexpr int kPointsPerParameter = 2048, kMaxImportancePoints = 4096;

// Moves of particles that were drawn with a doubtful tail of their weights.
constexpr int kSweeps = 40;

}  // namespace

absl::StatusOr<Particles> SampleForReexpansion(const Cost& cost, const ExpansionDesign& design,
                                               const Matrix& guesses, uint64_t seed,
                                               const Stop& stop) {
  SamplerOptions options;
  options.seed = seed;
  const Matrix local = design.region.ManyToLocal(guesses);
  const int points = std::min(kMaxImportancePoints, kPointsPerParameter * cost.dimension());
  const GuardedDraws drawn = DrawIfNearlyGaussian(cost, design, local, points, stop);
  POLYEST_RETURN_IF_ERROR(stop.Check());
  if (drawn.draws) return Resampled(*drawn.draws, options.particles, seed);
  Vector lower, upper;
  SamplingBox(design, lower, upper);
  if (drawn.rough) {
    Particles particles = Resampled(*drawn.rough, options.particles, seed);
    DifferentialEvolution moves(cost, lower, upper, seed);
    for (int i = 0; i < kSweeps; ++i) {
      POLYEST_RETURN_IF_ERROR(stop.Check());
      moves.Sweep(1, 0, particles.etas.rows(), particles);
    }
    return particles;
  }
  return SamplePosterior(cost, lower, upper, local, options, stop);
}

}  // namespace polyest::internal
