#include "core/estimator/posterior/cover_draws.h"

#include <cmath>

#include "core/bayes/differential_evolution.h"
#include "core/bayes/weighted_samples.h"
#include "core/chaos/collocation_points.h"

namespace polyest::internal {
namespace {

constexpr int kMaxDimension = 3;
constexpr int kFirstPoints = 4096;
constexpr int kMaxRefinements = 8;
// A point whose density is less than e^−18 of the highest has no noticeable weight.
constexpr double kNegligibleCost = 18;
// Effective number of points at which a cover resolves the density.
constexpr double kResolved = 64;
constexpr double kTemper = 0.5;
// The most points, of those asked for. A posterior that fills a smaller part of the box needs far
// more of them: in three dimensions, means from four times as many are off by 0.06 deviations.
constexpr double kMaxMultiple = 2;
constexpr double kSpare = 1.1;  // points more than are expected to be enough

struct Box {
  Vector lower, upper;
};

Matrix CoverOf(const Box& box, int points) {
  const int n = static_cast<int>(box.lower.size());
  Matrix cover = UnitCubePoints(PointSet::kHalton, n, points);
  cover *= (box.upper - box.lower).asDiagonal();
  cover.rowwise() += box.lower.transpose();
  return cover;
}

// Returns the largest power of the density, in halves, that the cover resolves. A narrower density
// lies between the points, where one of its pieces would be seen and another not.
double ResolvedPower(const Vector& costs) {
  double power = 1;
  for (; power > 1e-12; power *= kTemper) {
    const Vector weights = (power * (costs.minCoeff() - costs.array())).exp();
    if (EffectiveSizeOfWeights(weights) >= kResolved) break;
  }
  return power;
}

// Returns the box around the points that have noticeable weight, widened by the spacing of so many
// points and cut to the box covered.
Box BoxOfWeight(const Matrix& cover, const Vector& costs, const Box& covered) {
  const double most = costs.minCoeff() + kNegligibleCost / ResolvedPower(costs);
  Box box{covered.upper, covered.lower};
  for (Eigen::Index i = 0; i < cover.rows(); ++i) {
    if (!(costs[i] < most)) continue;
    box.lower = box.lower.cwiseMin(cover.row(i).transpose());
    box.upper = box.upper.cwiseMax(cover.row(i).transpose());
  }
  const double spacing =
      2 / std::pow(static_cast<double>(cover.rows()), 1.0 / static_cast<double>(cover.cols()));
  const Vector margin = spacing * (covered.upper - covered.lower);
  return {(box.lower - margin).cwiseMax(covered.lower),
          (box.upper + margin).cwiseMin(covered.upper)};
}

WeightedDraws WeightedBy(const Vector& costs, const Matrix& cover) {
  WeightedDraws draws;
  const Vector weights = (costs.minCoeff() - costs.array()).exp();
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < costs.size(); ++i) {
    if (std::isfinite(costs[i]) && weights[i] > 0) kept.push_back(i);
  }
  draws.etas = cover(kept, Eigen::all);
  draws.costs = costs(kept);
  draws.weights = weights(kept) / weights(kept).sum();
  draws.effective_size = 1 / draws.weights.squaredNorm();
  return draws;
}

}  // namespace

std::optional<WeightedDraws> DrawFromCover(const Cost& cost, const ExpansionDesign& design,
                                           int points, double effective_size) {
  if (cost.dimension() > kMaxDimension) return std::nullopt;
  Box box;
  SamplingBox(design, box.lower, box.upper);
  const DifferentialEvolution confined(cost, box.lower, box.upper, 0);
  Matrix cover;
  Vector costs;
  for (int i = 0; i < kMaxRefinements; ++i) {
    cover = CoverOf(box, kFirstPoints);
    confined.Evaluate(cover, costs);
    if (!std::isfinite(costs.minCoeff())) return std::nullopt;
    const Box smaller = BoxOfWeight(cover, costs, box);
    const double ratio =
        (smaller.upper - smaller.lower).cwiseQuotient(box.upper - box.lower).prod();
    box = smaller;
    if (ratio > 0.5) break;
  }
  // The effective number grows as the number of points.
  for (double count = points; count <= kMaxMultiple * points;) {
    cover = CoverOf(box, static_cast<int>(count));
    confined.Evaluate(cover, costs);
    if (!std::isfinite(costs.minCoeff())) return std::nullopt;
    WeightedDraws draws = WeightedBy(costs, cover);
    if (draws.effective_size >= effective_size) return draws;
    count *= kSpare * effective_size / draws.effective_size;
  }
  return std::nullopt;
}

}  // namespace polyest::internal
