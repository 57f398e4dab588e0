#include "core/estimator/expansion/reexpansion_memory.h"

#include <cmath>

#include "core/bayes/weighted_samples.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// Least effective size of reweighted particles, as a fraction of their number.
constexpr double kMinEffectiveToReweigh = 0.9;
// Fewer particles than this do not tell what one in a hundred of them does.
constexpr Eigen::Index kMinParticles = 500;
// By how much a region may reach beyond another one that contains it, as a factor.
constexpr double kBeyond = 1.1;
constexpr int64_t kGrowthOfRecord = 2;

Vector NoiseVariances(const LearnedNoise& noise) {
  Vector variances(std::ssize(noise.channels));
  for (size_t c = 0; c < noise.channels.size(); ++c) {
    const double scale = noise.channels[c].scale;
    variances[static_cast<Eigen::Index>(c)] = scale * scale * noise.misfit;
  }
  return variances;
}

// Whether the box (centre, axes) lies in the region.
bool Contains(const Region& region, const Vector& centre, const Matrix& axes) {
  const Matrix to_local = Inverse(region.axes());
  const Vector place = to_local * (centre - region.centre());
  const Vector extent = (to_local * axes).cwiseAbs().rowwise().sum();
  return (place.cwiseAbs() + extent).maxCoeff() <= kBeyond;
}

}  // namespace

OrderInVain TriedInVain(int order, double error, const Region& region, int64_t rows,
                        const LearnedNoise& noise) {
  return {order, error, region.centre(), region.axes(), rows, NoiseVariances(noise)};
}

bool IsRaisingInVain(const OrderInVain& tried, double accepted, const Region& region, int64_t rows,
                     const LearnedNoise& noise) {
  if (tried.order == 0 || rows >= kGrowthOfRecord * tried.rows) return false;
  if (!Contains(region, tried.centre, tried.axes)) return false;
  const double louder = NoiseVariances(noise).cwiseQuotient(tried.noise_variance).maxCoeff();
  return tried.error > accepted * louder;
}

Matrix Reweighted(const Matrix& particles, const Vector& costs, const Cost& present,
                  const ExpansionDesign& design) {
  const Matrix none(0, particles.cols());
  if (costs.size() != particles.rows() || costs.size() < kMinParticles) return none;
  const Matrix etas = design.region.ManyToLocal(particles);
  Vector now;
  present.EvaluateMany(etas, now);
  Vector weights = costs - now;
  const double most = weights.maxCoeff();
  if (!std::isfinite(most)) return none;
  weights = (weights.array() - most).exp();
  const auto count = static_cast<double>(weights.size());
  if (!(EffectiveSizeOfWeights(weights) >= kMinEffectiveToReweigh * count)) return none;
  weights /= weights.sum();
  return etas(EquallyWeighted(weights, static_cast<int>(weights.size())), Eigen::all);
}

}  // namespace polyest::internal
