#include "core/bayes/importance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "core/bayes/differential_evolution.h"
#include "core/chaos/collocation_points.h"
#include "core/common/check.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

struct Component {
  double share;
  double scale;
};
using Mixture = std::array<Component, 2>;

// Returns the components, the narrower first. For a Gaussian its own Σ w² grows as (s²/√(2s² − 1))ⁿ
// ≈ e^{n (s² − 1)²/2}, so s is chosen to keep that bounded.
Mixture MixtureOf(int dimension) {
  const double narrow = std::sqrt(1 + 0.6 / std::sqrt(static_cast<double>(dimension)));
  return {{{0.85, std::min(1.1, narrow)}, {0.15, 2.0}}};
}

// Points u of the mixture before L⁻ᵀ, and log q at each.
struct Proposal {
  Matrix points;
  Vector log_density;
};

// The first share of the points is scaled for the first component and so on. Stretches of a Halton
// sequence are themselves low-discrepancy points.
Proposal MakeProposal(int dimension, int points) {
  const std::vector<Germ> germs(static_cast<size_t>(dimension), Germ::Normal());
  Proposal proposal{HaltonDraws(germs, points), {}};
  ScaleAsProposal(proposal.points);
  proposal.log_density = ProposalLogDensity(proposal.points.rowwise().squaredNorm(), dimension);
  return proposal;
}

// Returns the proposal, which is the same for all posteriors and takes longer to make than the
// costs of a small problem. Those of usual sizes are kept, at most 16 MB.
std::shared_ptr<const Proposal> ProposalOf(int dimension, int points) {
  constexpr int kMaxKeptDimensions = 12, kMaxKeptPoints = 16'384;
  if (dimension > kMaxKeptDimensions || points > kMaxKeptPoints) {
    return std::make_shared<const Proposal>(MakeProposal(dimension, points));
  }
  static std::mutex mutex;
  static std::map<std::pair<int, int>, std::shared_ptr<const Proposal>> kept;
  const std::lock_guard lock(mutex);
  std::shared_ptr<const Proposal>& proposal = kept[{dimension, points}];
  if (!proposal) proposal = std::make_shared<const Proposal>(MakeProposal(dimension, points));
  return proposal;
}

}  // namespace

Vector ProposalLogDensity(const Vector& squared_radii, int dimension) {
  const Mixture mixture = MixtureOf(dimension);
  // The sum is relative to the widest component, whose exponential underflows last.
  const Eigen::ArrayXd widest =
      0.5 * squared_radii.array() / (mixture.back().scale * mixture.back().scale);
  Eigen::ArrayXd density = Eigen::ArrayXd::Zero(squared_radii.size());
  for (const Component& c : mixture) {
    density += c.share * std::pow(c.scale, -dimension) *
               (widest - 0.5 * squared_radii.array() / (c.scale * c.scale)).exp();
  }
  return density.log() - widest;
}

void ScaleAsProposal(Matrix& points) {
  const Mixture mixture = MixtureOf(static_cast<int>(points.cols()));
  const auto count = static_cast<double>(points.rows());
  const auto first = static_cast<Eigen::Index>(mixture.front().share * count);
  points.topRows(first) *= mixture.front().scale;
  points.bottomRows(points.rows() - first) *= mixture.back().scale;
}

WeightedDraws WeighProposed(const Cost& cost, const Vector& lower, const Vector& upper, Matrix etas,
                            const Vector& log_density) {
  WeightedDraws draws;
  Vector costs;
  const DifferentialEvolution box(cost, lower, upper, 0);
  box.Evaluate(etas, costs);
  const double least = costs.minCoeff();
  if (!std::isfinite(least)) return draws;
  // log w = −J − log q
  const Vector log_weights = least - costs.array() - log_density.array();
  Vector weights = (log_weights.array() - log_weights.maxCoeff()).exp();
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < etas.rows(); ++i) {
    // The weight is tested, too: a vectorized exponential of −∞ need not be 0.
    if (!std::isfinite(costs[i]) || !(weights[i] > 0)) continue;
    etas.row(kept) = etas.row(i);
    costs[kept] = costs[i];
    weights[kept++] = weights[i];
  }
  draws.etas = etas.topRows(kept);
  draws.costs = costs.head(kept);
  draws.weights = weights.head(kept) / weights.head(kept).sum();
  draws.effective_size = 1 / draws.weights.squaredNorm();
  return draws;
}

WeightedDraws ImportanceSample(const Cost& cost, const Vector& lower, const Vector& upper,
                               const ConstVectorRef& minimum, const ConstMatrixRef& hessian_factor,
                               int points) {
  POLYEST_CHECK(points >= 100);
  const std::shared_ptr<const Proposal> proposal = ProposalOf(cost.dimension(), points);
  // η = η̂ + L⁻ᵀ u, a point a row: (uᵀ L⁻¹) = (L⁻ᵀ u)ᵀ
  Matrix etas = SolveLowerTransposedRows(hessian_factor, proposal->points);
  etas.rowwise() += minimum.transpose();
  return WeighProposed(cost, lower, upper, std::move(etas), proposal->log_density);
}

}  // namespace polyest::internal
