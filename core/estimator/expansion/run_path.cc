#include "core/estimator/expansion/run_path.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/common/infeasible.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {

Matrix SpreadOf(const Matrix& covariance, const Vector& unit) {
  constexpr double kMinSpread = 1e-9;
  const Matrix least = (kMinSpread * unit).cwiseAbs2().asDiagonal();
  const CholeskyFactor factor(0.5 * (covariance + covariance.transpose()) + least);
  if (factor.positive_definite()) return factor.Lower();
  return Matrix(covariance.diagonal().cwiseMax(least.diagonal()).cwiseSqrt().asDiagonal());
}

Matrix NoWiderThan(const Vector& unit, const Matrix& covariance) {
  const Vector most = unit.cwiseQuotient(covariance.diagonal().cwiseSqrt()).cwiseMin(1);
  return most.asDiagonal() * covariance * most.asDiagonal();
}

EndedRuns WithoutEndedRuns(const ResolvedProblem& problem, Region region,
                           const GermSummary& posterior, const LearnedNoise& noise) {
  EndedRuns ended;
  const auto shared = static_cast<size_t>(region.dimension());
  ended.region = std::move(region);
  ended.centre = posterior.mean;
  ended.factor = SpreadOf(posterior.covariance, Vector::Ones(posterior.mean.size()));
  const auto of_one_run = static_cast<int>(problem.problem().uncertain.size());
  ended.basis = std::make_shared<Basis>(std::vector<Germ>(shared, Germ::Uniform()),
                                        FirstTruncation(problem.problem().expansion, of_one_run));
  const auto channels = static_cast<size_t>(problem.channels());
  ended.sums.assign(channels, ChannelSums(ended.basis->size()));
  ended.discount = ended.largest = Vector::Zero(problem.channels());
  ended.outliers.assign(channels, 0);
  ended.left_out = Vector::Zero(ended.region.dimension());
  ended.remainder = Vector::Zero(ended.basis->size());
  ended.noise_scale.resize(problem.channels());
  ended.noise_time_constant_s.resize(problem.channels());
  ended.noise_white_share.resize(problem.channels());
  for (size_t c = 0; c < channels; ++c) {
    const auto channel = static_cast<Eigen::Index>(c);
    ended.noise_scale[channel] = noise.channels[c].scale;
    ended.noise_time_constant_s[channel] = noise.channels[c].time_constant_s;
    ended.noise_white_share[channel] = noise.channels[c].white_share;
  }
  return ended;
}

void FreeOfPopulation(const ResolvedProblem& problem, Matrix& slope) {
  const auto population = problem.population();
  if (!population) return;
  const std::vector<int> shared = problem.SharedParameters();
  for (const int part : {population->mean, population->spread}) {
    slope.col(std::ranges::find(shared, part) - shared.begin()).setZero();
  }
}

RunPath PathIn(const ResolvedProblem& problem, int run, const GermSummary& posterior,
               const Vector& centre) {
  const std::vector<int> shared = problem.SharedParameters(), own = problem.OwnParameters(run);
  const Matrix& covariance = posterior.covariance;
  RunPath path;
  const Matrix both = covariance(own, shared);
  path.slope = both * Inverse(covariance(shared, shared));
  FreeOfPopulation(problem, path.slope);
  path.centre = posterior.mean(own) + path.slope * (centre - posterior.mean(shared));
  path.spread = SpreadOf(covariance(own, own) - path.slope * both.transpose(),
                         problem.prior().GermStandardDeviation()(own));
  return path;
}

absl::Status CheckFinite(const RunPath& path, int run) {
  if (path.centre.allFinite() && path.slope.allFinite() && path.spread.allFinite()) {
    return absl::OkStatus();
  }
  return InfeasibleError(absl::StrFormat(
      "the own parameters of run %d cannot be integrated out: the posterior of what is shared is "
      "degenerate",
      run));
}

}  // namespace polyest::internal
