#include "core/bayes/posterior.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/bayes/domain_cover.h"
#include "core/bayes/weighted_samples.h"
#include "core/common/infeasible.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr int kCoverPerParticle = 4;  // points that cover the box, for each particle
constexpr int kMinStartingPoints = 50;
constexpr double kEffectiveFraction = 0.5;
constexpr double kShrink = 0.7;  // of the guesses, mixed with 0.3 of the cover
constexpr int kBisections = 50;

class Sampler {
 public:
  Sampler(const Cost& cost, const Vector& lower, const Vector& upper, const SamplerOptions& options)
      : cost_(cost),
        lower_(lower),
        upper_(upper),
        options_(options),
        moves_(cost, lower, upper, options.seed) {}

  absl::StatusOr<Particles> Run(const Matrix& guesses, const Stop& stop) {
    POLYEST_RETURN_IF_ERROR(Start(guesses));
    double beta = 0;
    int done = 0;
    while (beta < 1) {
      const double step = TemperingStep(1 - beta);
      Resample(step);
      beta = step >= 1 - beta ? 1 : beta + step;
      const int sweeps = beta < 1 ? options_.sweeps
                                  : std::max(options_.final_sweeps, options_.total_sweeps - done);
      done += sweeps;
      for (int i = 0; i < sweeps; ++i) {
        POLYEST_RETURN_IF_ERROR(stop.Check());
        moves_.Sweep(beta, 0, particles_.etas.rows(), particles_);
      }
    }
    return std::move(particles_);
  }

 private:
  absl::Status Start(const Matrix& guesses) {
    const Matrix cover = CoverOfDomain(cost_.region(), cost_.prior(), lower_, upper_, guesses,
                                       kCoverPerParticle * options_.particles);
    const Eigen::Index g = std::min(guesses.rows(), cover.rows());
    Matrix start(2 * g + cover.rows(), cover.cols());
    const auto used = guesses.topRows(g);
    start << used, kShrink * used + (1 - kShrink) * cover.topRows(g), cover;
    Vector costs;
    moves_.Evaluate(start, costs);
    Eigen::Index kept = 0;
    for (Eigen::Index i = 0; i < start.rows(); ++i) {
      if (!std::isfinite(costs[i])) continue;
      start.row(kept) = start.row(i);
      costs[kept++] = costs[i];
    }
    if (kept < kMinStartingPoints) {
      return InfeasibleError(absl::StrFormat(
          "only %d of %d starting points of the sampler have a finite cost", kept, start.rows()));
    }
    particles_ = {start.topRows(kept), costs.head(kept)};
    // Resampling takes evenly spaced ones, and every fourth of Halton's points lies in one quarter.
    Shuffle();
    return absl::OkStatus();
  }

  // Returns the weights e^{−step (J − min J)}, not normalized.
  Vector Weights(double step) const {
    return (-step * (particles_.costs.array() - particles_.costs.minCoeff())).exp();
  }

  // Returns the largest step ≤ most that keeps the effective size (Σ w)²/Σ w² above half of the
  // particles, rounded up: it is never 0, so that the tempering ends.
  double TemperingStep(double most) const {
    const auto keeps_enough = [&](double step) {
      const Vector w = Weights(step);
      return EffectiveSizeOfWeights(w) >= kEffectiveFraction * static_cast<double>(w.size());
    };
    if (keeps_enough(most)) return most;
    double low = 0;
    double high = most;
    for (int i = 0; i < kBisections; ++i) {
      const double middle = 0.5 * (low + high);
      (keeps_enough(middle) ? low : high) = middle;
    }
    return high;
  }

  // Resamples to options_.particles systematically: one uniform draw, evenly spaced pointers.
  void Resample(double step) {
    const Vector weights = Weights(step);
    const double spacing = weights.sum() / options_.particles;
    double pointer = spacing * moves_.Uniform();
    Particles chosen{Matrix(options_.particles, particles_.etas.cols()),
                     Vector(options_.particles)};
    Eigen::Index source = 0;
    double cumulative = weights[0];
    for (int i = 0; i < options_.particles; ++i, pointer += spacing) {
      while (cumulative < pointer && source + 1 < weights.size()) cumulative += weights[++source];
      chosen.etas.row(i) = particles_.etas.row(source);
      chosen.costs[i] = particles_.costs[source];
    }
    particles_ = std::move(chosen);
    Shuffle();
  }

  // Shuffles the particles. Systematic resampling leaves copies side by side, and the halves that
  // move each other must not depend on that order.
  void Shuffle() {
    for (Eigen::Index i = particles_.etas.rows() - 1; i > 0; --i) {
      const Eigen::Index j = moves_.Draw(i + 1);
      particles_.etas.row(i).swap(particles_.etas.row(j));
      std::swap(particles_.costs[i], particles_.costs[j]);
    }
  }

  const Cost& cost_;
  const Vector& lower_;
  const Vector& upper_;
  const SamplerOptions& options_;
  DifferentialEvolution moves_;
  Particles particles_;
};

}  // namespace

absl::StatusOr<Particles> SamplePosterior(const Cost& cost, const Vector& lower,
                                          const Vector& upper, const Matrix& guesses,
                                          const SamplerOptions& options, const Stop& stop) {
  return Sampler(cost, lower, upper, options).Run(guesses, stop);
}

}  // namespace polyest::internal
