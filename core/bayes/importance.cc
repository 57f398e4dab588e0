#include "core/bayes/importance.h"

#include <algorithm>
#include <array>
#include <cmath>

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

// Returns log Σ_c p_c s_c⁻ⁿ e^{−r²/2s_c²}.
double LogProposal(const Mixture& mixture, double squared_radius, int dimension) {
  double density = 0;
  // The sum is relative to the widest component, whose exponential underflows last.
  const double widest = 0.5 * squared_radius / std::pow(mixture.back().scale, 2);
  for (const Component& c : mixture) {
    density += c.share * std::pow(c.scale, -dimension) *
               std::exp(widest - 0.5 * squared_radius / (c.scale * c.scale));
  }
  return std::log(density) - widest;
}

// Returns standard normal points, the first share of them scaled for the first component and so on.
// Stretches of a Halton sequence are themselves low-discrepancy points.
Matrix MixturePoints(const Mixture& mixture, int dimension, int points) {
  const std::vector<Germ> germs(static_cast<size_t>(dimension), Germ::Normal());
  Matrix normal = CollocationPoints(PointSet::kHalton, germs, 0, points).value();
  const auto first = static_cast<Eigen::Index>(mixture.front().share * points);
  normal.topRows(first) *= mixture.front().scale;
  normal.bottomRows(points - first) *= mixture.back().scale;
  return normal;
}

}  // namespace

WeightedDraws ImportanceSample(const Cost& cost, const Vector& lower, const Vector& upper,
                               const ConstVectorRef& minimum, const ConstMatrixRef& hessian_factor,
                               int points) {
  POLYEST_CHECK(points >= 100);
  const int n = cost.dimension();
  const Mixture mixture = MixtureOf(n);
  const Matrix normal = MixturePoints(mixture, n, points);
  // η = η̂ + L⁻ᵀ u, a point a row: (uᵀ L⁻¹) = (L⁻ᵀ u)ᵀ
  Matrix etas = SolveLowerTransposedRows(hessian_factor, normal);
  etas.rowwise() += minimum.transpose();
  WeightedDraws draws;
  Vector costs;
  const DifferentialEvolution box(cost, lower, upper, 0);
  box.Evaluate(etas, costs);
  const double least = costs.minCoeff();
  if (!std::isfinite(least)) return draws;
  Vector log_weights(points);
  for (Eigen::Index i = 0; i < points; ++i) {
    // log w = −J − log q
    log_weights[i] = least - costs[i] - LogProposal(mixture, normal.row(i).squaredNorm(), n);
  }
  Vector weights = (log_weights.array() - log_weights.maxCoeff()).exp();
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < points; ++i) {
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

}  // namespace polyest::internal
