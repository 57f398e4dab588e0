#include "core/estimator/expansion/new_runs.h"

#include <cmath>
#include <utility>
#include <vector>

#include "core/chaos/collocation_points.h"
#include "core/common/check.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {
namespace {

std::vector<Germ> NewGerms(const ResolvedProblem& grown, Eigen::Index known) {
  const std::vector<Germ>& germs = grown.prior().germs();
  return {germs.begin() + known, germs.end()};
}

// Returns the present region, extended by the box of the new germs that contains all but a
// negligible part of their prior.
Region RegionWith(const Region& present, const std::vector<Germ>& germs) {
  const Eigen::Index known = present.dimension(), n = known + std::ssize(germs);
  Vector centre(n);
  Matrix axes = Matrix::Zero(n, n);
  centre.head(known) = present.centre();
  axes.topLeftCorner(known, known) = present.axes();
  for (Eigen::Index j = known; j < n; ++j) {
    const auto [lower, upper] = TrustedRange(germs[static_cast<size_t>(j - known)]);
    centre[j] = 0.5 * (lower + upper);
    axes(j, j) = 0.5 * (upper - lower);
  }
  return Region(std::move(centre), std::move(axes));
}

// Adds the present check points, repeated until there are enough, with draws of the prior in the
// new dimensions.
void AddCheckPoints(const ResolvedProblem& grown, const ExpansionDesign& present,
                    ExpansionDesign& design) {
  const Eigen::Index count = CheckCount(grown.dimension()), known = present.check_points.rows();
  if (known == 0) return;
  const Matrix before = present.region.ManyToGerm(present.check_points);
  Matrix repeated(count, before.cols());
  for (Eigen::Index i = 0; i < count; ++i) repeated.row(i) = before.row(i % known);
  const Matrix xis = ParticlesForNewRuns(grown, repeated);
  design.check_points = design.region.ManyToLocal(xis);
  design.check_costs.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    double cost = present.check_costs[i % known];
    for (Eigen::Index j = before.cols(); j < xis.cols(); ++j) {
      cost -= grown.prior().germs()[static_cast<size_t>(j)].LogDensity(xis(i, j));
    }
    design.check_costs[i] = cost;
  }
}

}  // namespace

absl::StatusOr<ExpansionDesign> DesignForNewRuns(const ResolvedProblem& grown,
                                                 const ExpansionDesign& present) {
  if (present.whole_prior || present.in_tails) return DesignToBeginWith(grown);
  const Eigen::Index known = present.region.dimension();
  POLYEST_CHECK(known <= grown.dimension());
  Region region = RegionWith(TrustedRegion(present), NewGerms(grown, known));
  const Vector inside = region.centre();
  ExpansionDesign design =
      DesignForRegion(grown, FirstTruncation(grown.problem().expansion, grown.dimension()),
                      std::move(region), inside);
  AddCheckPoints(grown, present, design);
  design.checks_are_draws = present.checks_are_draws;
  design.element = present.element.WithDimension(grown.dimension());
  return design;
}

Matrix ParticlesForNewRuns(const ResolvedProblem& grown, const Matrix& present) {
  const Eigen::Index known = present.cols();
  Matrix particles(present.rows(), grown.dimension());
  particles.leftCols(known) = present;
  if (known == grown.dimension() || present.rows() == 0) return particles;
  particles.rightCols(grown.dimension() - known) =
      HaltonDraws(NewGerms(grown, known), static_cast<int>(present.rows()));
  return particles;
}

PosteriorSummary SummaryForNewRuns(const ResolvedProblem& grown, const PosteriorSummary& present) {
  const Eigen::Index known = present.centre.size(), n = grown.dimension();
  if (known == 0) return present;
  PosteriorSummary summary{Vector(n), Matrix::Zero(n, n)};
  summary.centre.head(known) = present.centre;
  summary.factor.topLeftCorner(known, known) = present.factor;
  const Vector deviation = grown.prior().GermStandardDeviation();
  for (Eigen::Index j = known; j < n; ++j) {
    summary.centre[j] = grown.prior().germs()[static_cast<size_t>(j)].Mean();
    summary.factor(j, j) = deviation[j];
  }
  return summary;
}

Particles DrawsForNewRun(const ResolvedProblem& problem, const Vector& centre, const Matrix& factor,
                         int count) {
  const std::vector<int> shared = problem.SharedParameters();
  const std::vector<Germ>& germs = problem.prior().germs();
  const Matrix cube = UnitCubePoints(PointSet::kHalton, problem.dimension(), count);
  Particles draws{Matrix(count, problem.dimension()), Vector::Zero(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    Vector xi(problem.dimension());
    for (const int j : problem.OwnParameters(problem.runs() - 1)) {
      xi[j] = germs[static_cast<size_t>(j)].Quantile(cube(i, j));
      draws.costs[i] -= germs[static_cast<size_t>(j)].LogDensity(xi[j]);
    }
    const Vector deviate = cube.row(i)(shared).transpose().unaryExpr(
        [](double u) { return Germ::Normal().Quantile(u); });
    xi(shared) = centre + factor * deviate;
    draws.costs[i] += 0.5 * deviate.squaredNorm();
    draws.etas.row(i) = NearestInside(problem.prior(), xi).transpose();
  }
  return draws;
}

ExpansionDesign DesignAfterEndedRuns(const ResolvedProblem& problem, const Vector& centre,
                                     const Matrix& factor, const Element& present) {
  constexpr double kDeviations = 4.5;
  const std::vector<int> shared = problem.SharedParameters();
  const std::vector<Germ>& germs = problem.prior().germs();
  const int n = problem.dimension();
  Vector middle(n);
  Matrix axes = Matrix::Zero(n, n);
  middle(shared) = centre;
  const SymmetricEigen eigen = DecomposeSymmetric(factor * factor.transpose());
  axes(shared, shared) =
      kDeviations * eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
  for (const int j : problem.OwnParameters(problem.runs() - 1)) {
    const auto [lower, upper] = TrustedRange(germs[static_cast<size_t>(j)]);
    middle[j] = 0.5 * (lower + upper);
    axes(j, j) = 0.5 * (upper - lower);
  }
  const Region region(middle, axes);
  ExpansionDesign design = DesignForRegion(problem, FirstTruncation(problem.problem().expansion, n),
                                           region, MiddleInside(problem.prior(), region));
  const Particles checks = DrawsForNewRun(problem, centre, factor, CheckCount(n));
  SetDrawnChecks(checks.etas, checks.costs, design);
  // Bounds along the own germs of earlier runs say nothing of this one's.
  design.element = present.AlongGerms(shared);
  return design;
}

PosteriorSummary SummaryAfterEndedRuns(const ResolvedProblem& problem, const Vector& centre,
                                       const Matrix& factor) {
  const std::vector<int> shared = problem.SharedParameters();
  const Vector deviation = problem.prior().GermStandardDeviation();
  PosteriorSummary summary;
  summary.centre.resize(problem.dimension());
  summary.factor = Matrix::Zero(problem.dimension(), problem.dimension());
  for (const int j : problem.OwnParameters(problem.runs() - 1)) {
    summary.centre[j] = problem.prior().germs()[static_cast<size_t>(j)].Mean();
    summary.factor(j, j) = deviation[j];
  }
  summary.centre(shared) = centre;
  summary.factor(shared, shared) = factor;
  return summary;
}

}  // namespace polyest::internal
