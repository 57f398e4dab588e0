#include "core/estimator/expansion/overlooked_minima.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "core/bayes/cost_minima.h"
#include "core/common/infeasible.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/expansion/carry_over.h"
#include "core/estimator/expansion/model_agreement.h"
#include "core/estimator/expansion/replay.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {
namespace {

constexpr int kMaxStarts = 12;  // of collocation points, and of guesses
constexpr int kMaxRuns = 6;     // of the model, at the lowest minima outside
// How far the model's cost at such a minimum may be above its cost at the lowest one. The minimum
// of an inaccurate expansion lies beside the model's, so that more than its weight is allowed for.
constexpr double kMaxAbove = 12;

// Returns the model's cost at a point (local coordinates) from its χ² of each channel.
double ModelCost(const RegionalExpansion& expansion, const Cost& cost, const Vector& eta,
                 const Vector& chi_squared) {
  const double model = ModelMismatch(expansion, cost.BasisDifference(eta), chi_squared);
  const double prior = cost.prior().NegativeLogDensity(cost.region().ToGerm(eta));
  return cost.power() * model + cost.regularization() * prior;
}

// Returns the rows of `points` with the least of the costs, kMaxStarts at most.
Matrix Least(const Matrix& points, const Vector& costs) {
  std::vector<Eigen::Index> order(static_cast<size_t>(points.rows()));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order,
                           [&](Eigen::Index a, Eigen::Index b) { return costs[a] < costs[b]; });
  order.resize(std::min<size_t>(kMaxStarts, order.size()));
  return points(order, Eigen::all);
}

// Returns the collocation points of least cost, by the model or by the expansion.
Matrix BestPoints(const RegionalExpansion& expansion, const Cost& cost) {
  const Matrix& points = expansion.design().points;
  Vector least;
  cost.EvaluateMany(points, least);
  const Matrix chi_squared_of_points = expansion.absorbed().PointChiSquared();
  for (Eigen::Index q = 0; q < points.rows(); ++q) {
    const Vector chi_squared = chi_squared_of_points.row(q).transpose();
    const double model = chi_squared.allFinite()
                             ? ModelCost(expansion, cost, points.row(q).transpose(), chi_squared)
                             : kInfinity;
    least[q] = std::fmin(std::fmin(least[q], model), kInfinity);
  }
  return Least(points, least);
}

// Returns the guesses (germ coordinates) of least cost outside the region, in local coordinates.
Matrix BestOutside(const Cost& cost, const Matrix& guesses, const Region& region) {
  const Matrix inside = region.ManyToLocal(guesses);
  std::vector<Eigen::Index> outside;
  for (Eigen::Index i = 0; i < guesses.rows(); ++i) {
    if (inside.row(i).cwiseAbs().maxCoeff() > 1) outside.push_back(i);
  }
  if (outside.empty()) return Matrix(0, cost.dimension());
  const Matrix etas = cost.region().ManyToLocal(guesses(outside, Eigen::all));
  Vector costs;
  cost.EvaluateMany(etas, costs);
  return Least(etas, costs.unaryExpr([](double c) { return std::fmin(c, kInfinity); }));
}

// Returns the minima (local coordinates) that lie outside the region of the particles, the lowest
// ones first, and before them the lowest of all.
Matrix LowestAndOutside(const RegionalExpansion& expansion, const Cost& cost,
                        const Matrix& particles, const Matrix& guesses, const Stop& stop) {
  const MinimizationProblem search = SearchOf(cost, expansion.design());
  const Region kept = RegionOfParticles(particles);
  const Matrix points = BestPoints(expansion, cost);
  const Matrix outside = BestOutside(cost, guesses, kept);
  Matrix starts(points.rows() + outside.rows(), cost.dimension());
  starts << points, outside;
  const std::vector<Minimum> minima = FindMinimaOf(cost, search, starts, stop);
  Matrix found(1, cost.dimension());
  found.row(0) = minima.front().point.transpose();
  for (const Minimum& minimum : minima) {
    const Vector local = kept.ToLocal(expansion.design().region.ToGerm(minimum.point));
    if (!minimum.converged || local.cwiseAbs().maxCoeff() <= 1) continue;
    found.conservativeResize(found.rows() + 1, Eigen::NoChange);
    found.bottomRows(1) = minimum.point.transpose();
    if (found.rows() > kMaxRuns) break;
  }
  return found;
}

// Runs the model at points (local coordinates of `present`, one row each) along the record. The
// expansion that does so is of order 1, since its few collocation points serve for nothing.
absl::StatusOr<std::unique_ptr<RegionalExpansion>> RunModel(const RegionalExpansion& present,
                                                            const Matrix& etas,
                                                            const Vector& inside,
                                                            const ReexpansionRequest& request,
                                                            const Stop& stop) {
  Truncation truncation =
      FirstTruncation(request.problem->problem().expansion, present.design().region.dimension());
  truncation.order = 1;
  ExpansionDesign design =
      DesignForRegion(*request.problem, truncation, TrustedRegion(present.design()), inside);
  design.element = present.design().element;
  design.check_points = design.region.ManyToLocal(present.design().region.ManyToGerm(etas));
  design.check_costs = Vector::Zero(etas.rows());
  return Replay(*request.problem, std::move(design), present.noise().ForNewExpansion(),
                *request.store, request.rows, request.threads, stop);
}

// Returns the model's cost at points (local coordinates), +∞ where it fails; empty if it cannot be
// run there. Over a long record an expansion that is accurate in all of its region stands for it.
absl::StatusOr<std::vector<double>> CostsAt(const RegionalExpansion& expansion, const Cost& cost,
                                            const Matrix& etas, const Matrix& particles,
                                            const ReexpansionRequest& request, const Stop& stop,
                                            ConfirmedMinima& confirmed) {
  std::vector<double> costs(static_cast<size_t>(etas.rows()), kInfinity);
  if (request.rows > RowsOfShortRecord(*request.problem) &&
      LargestShift(expansion, cost.power()) <= kMaxCarriedShift) {
    for (size_t i = 0; i < costs.size(); ++i) {
      costs[i] = cost.Evaluate(etas.row(static_cast<Eigen::Index>(i)).transpose()).total;
    }
    return costs;
  }
  if (!request.allowance.AllowsRecord(request.rows)) return std::vector<double>();
  const Vector inside = particles.colwise().mean().transpose();
  auto model = RunModel(expansion, etas, inside, request, stop);
  if (IsInfeasible(model.status())) return std::vector<double>();
  if (!model.ok()) return model.status();
  confirmed.propagated_rows = (*model)->propagated_rows();
  const RegionalExpansion::Check checks = (*model)->Checks();
  for (size_t i = 0; i < costs.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (!checks.valid[i]) continue;
    costs[i] = ModelCost(expansion, cost, etas.row(row).transpose(),
                         checks.chi_squared.row(row).transpose());
  }
  return costs;
}

}  // namespace

absl::StatusOr<ConfirmedMinima> OverlookedMinima(const RegionalExpansion& expansion,
                                                 const Cost& cost, const Matrix& particles,
                                                 const ReexpansionRequest& request,
                                                 const Stop& stop) {
  ConfirmedMinima confirmed{.points = Matrix(0, cost.dimension())};
  const Matrix etas = LowestAndOutside(expansion, cost, particles, request.guesses, stop);
  POLYEST_RETURN_IF_ERROR(stop.Check());
  if (etas.rows() == 1) return confirmed;
  POLYEST_ASSIGN_OR_RETURN(const std::vector<double> costs,
                           CostsAt(expansion, cost, etas, particles, request, stop, confirmed));
  if (costs.empty()) return confirmed;
  std::vector<Eigen::Index> rows;
  const double limit = *std::min_element(costs.begin(), costs.end()) + kMaxAbove;
  for (size_t i = 0; i < costs.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (i > 0 && !(costs[i] < kInfinity && costs[i] <= limit)) continue;
    const double error = std::abs(costs[i] - cost.Evaluate(etas.row(row).transpose()).total);
    confirmed.error = std::max(confirmed.error, error);
    if (i > 0) rows.push_back(row);
  }
  confirmed.points = etas(rows, Eigen::all);
  return confirmed;
}

Matrix DrawsAround(const Cost& cost, const Vector& minimum, Eigen::Index count, uint64_t seed) {
  Matrix etas = minimum.transpose().replicate(count, 1);
  const SymmetricEigen curvature = DecomposeSymmetric(cost.Hessian(minimum));
  if (curvature.values.minCoeff() > 0) {
    const Matrix factor =
        curvature.vectors * curvature.values.cwiseSqrt().cwiseInverse().asDiagonal();
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    for (Eigen::Index i = 0; i < count; ++i) {
      const Vector z = Vector::NullaryExpr(minimum.size(), [&] { return normal(generator); });
      const Vector eta = minimum + factor * z;
      if (std::isfinite(cost.Evaluate(eta).total)) etas.row(i) = eta.transpose();
    }
  }
  return cost.region().ManyToGerm(etas);
}

}  // namespace polyest::internal
