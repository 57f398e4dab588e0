#include "core/estimator/posterior/max_log_evidence.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/bayes/cost_minima.h"
#include "core/bayes/differential_evolution.h"
#include "core/chaos/collocation_points.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/mixture_share.h"

namespace polyest::internal {
namespace {

constexpr int kCover = 512;
constexpr Eigen::Index kGuesses = 64;
constexpr int kStartsOfBound = 3;

}  // namespace

double MaxLogEvidence(const RegionalExpansion& expansion, const Cost& cost, const Matrix& guesses) {
  const ExpansionDesign& design = expansion.design();
  Vector lower, upper, costs;
  SamplingBox(design, lower, upper);
  const Eigen::Index guessed = std::min(kGuesses, guesses.rows());
  Matrix etas(kCover + guessed, cost.dimension());
  etas.topRows(kCover) =
      lower.transpose().replicate(kCover, 1) +
      UnitCubePoints(PointSet::kHalton, cost.dimension(), kCover) * (upper - lower).asDiagonal();
  etas.bottomRows(guessed) = design.region.ManyToLocal(guesses.topRows(guessed));
  DifferentialEvolution(cost, lower, upper, 0).Evaluate(etas, costs);
  std::vector<Eigen::Index> order(static_cast<size_t>(etas.rows()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::partial_sort(order.begin(), order.begin() + kStartsOfBound, order.end(),
                    [&](Eigen::Index a, Eigen::Index b) { return costs[a] < costs[b]; });
  order.resize(kStartsOfBound);
  double least = costs[order.front()];
  if (!std::isfinite(least)) return -kInfinity;
  const Matrix starts = etas(order, Eigen::all);
  for (const Minimum& minimum : FindMinimaOf(cost, SearchOf(cost, design), starts, Stop())) {
    least = std::min(least, minimum.value);
  }
  // ∫ e^{−J} dξ ≤ |box| e^{−min J}
  return design.region.LogVolume() + (upper - lower).array().log().sum() - least -
         HeightOf(expansion, cost);
}

}  // namespace polyest::internal
