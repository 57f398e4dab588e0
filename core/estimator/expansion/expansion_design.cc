#include "core/estimator/expansion/expansion_design.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/bayes/domain_cover.h"
#include "core/chaos/collocation_points.h"
#include "core/chaos/gauss_rule.h"
#include "core/common/check.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/expansion/germ_summary.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {
namespace {

constexpr double kTrustedProbability = 1e-3;  // omitted in each tail of an unbounded germ
constexpr double kFarTail = 1e-6;             // omitted in each tail of a germ, where tails matter
constexpr int kFewForTails = 2;               // parameters
constexpr double kMargin = 1.35;              // widening of a region beyond its particles
constexpr double kMinHalfWidth = 1e-10;       // minimum for a region, in germ units
constexpr double kGoesOnFraction = 0.2;       // minimum fraction of the particles at an edge
constexpr int kPointsPerDrawnCheck = 6;
constexpr int kMaxDrawnChecks = 200;
constexpr int kChecksPastDimension = 3;
constexpr double kJustInside = 1 - 1e-12;  // keeps rounding from putting a point outside Ω

int PointsFor(const ResolvedProblem& problem, const Basis& basis) {
  return static_cast<int>(PointCount(problem.problem().expansion, basis.size()));
}

// Returns local coordinates in units of the trusted box: e with η = middle + half ∘ e.
Matrix InBoxUnits(const ExpansionDesign& design, const Matrix& etas) {
  return (etas.rowwise() - design.Middle().transpose()).array().rowwise() /
         design.HalfWidths().transpose().array();
}

}  // namespace

int CheckCount(int dimension) { return dimension + kChecksPastDimension; }

void SetDrawnChecks(const ConstMatrixRef& xis, const ConstVectorRef& costs,
                    ExpansionDesign& design) {
  const int part = static_cast<int>(design.points.rows()) / kPointsPerDrawnCheck;
  const int most = std::max(CheckCount(design.basis->dimension()), std::min(part, kMaxDrawnChecks));
  const auto count = std::min<Eigen::Index>(most, xis.rows());
  design.check_points = design.region.ManyToLocal(xis.topRows(count));
  design.check_costs = costs.head(count);
  design.checks_are_draws = true;
}

std::pair<double, double> TrustedRange(const Germ& germ) {
  double lower = germ.Lower(), upper = germ.Upper();
  if (!std::isfinite(lower)) lower = germ.Quantile(kTrustedProbability);
  if (!std::isfinite(upper)) upper = germ.Quantile(1 - kTrustedProbability);
  return {lower, upper};
}

absl::StatusOr<ExpansionDesign> DesignForPrior(const ResolvedProblem& problem) {
  return DesignForPrior(problem, FirstTruncation(problem.problem().expansion, problem.dimension()));
}

absl::StatusOr<ExpansionDesign> DesignForPrior(const ResolvedProblem& problem,
                                               const Truncation& truncation) {
  const Prior& prior = problem.prior();
  const ExpansionOptions& options = problem.problem().expansion;
  const int n = problem.dimension();
  ExpansionDesign design;
  design.region = Region::WholePrior(n);
  design.basis = std::make_shared<Basis>(prior.germs(), truncation);
  const int order = design.basis->order();
  const int count = PointsFor(problem, *design.basis);
  POLYEST_ASSIGN_OR_RETURN(design.points, CollocationPoints(options.points, prior.germs(), order,
                                                            count, static_cast<int>(kMaxPoints)));
  // The check points are later points of a Halton sequence than the collocation points, so they are
  // draws of the prior.
  POLYEST_ASSIGN_OR_RETURN(
      const Matrix sequence,
      CollocationPoints(PointSet::kHalton, prior.germs(), order, count + CheckCount(n),
                        2 * static_cast<int>(kMaxPoints)));
  design.check_points = sequence.bottomRows(CheckCount(n));
  design.check_costs.resize(design.check_points.rows());
  for (Eigen::Index i = 0; i < design.check_costs.size(); ++i) {
    design.check_costs[i] = prior.NegativeLogDensity(design.check_points.row(i).transpose());
  }
  design.reference.resize(n);
  design.lower.resize(n);
  design.upper.resize(n);
  for (int j = 0; j < n; ++j) {
    const Germ& germ = prior.germs()[static_cast<size_t>(j)];
    design.reference[j] = germ.Mean();
    std::tie(design.lower[j], design.upper[j]) = TrustedRange(germ);
  }
  return design;
}

namespace {

// Moves the points outside Ω (local coordinates) towards `inside`.
void MoveInside(const Prior& prior, const Region& region, const Vector& inside, Matrix& points) {
  for (Eigen::Index q = 0; q < points.rows(); ++q) {
    const Vector xi = region.ToGerm(points.row(q).transpose());
    const double fraction = FractionInDomain(prior, xi, inside);
    if (fraction < 1) {
      points.row(q) = region.ToLocal(inside + kJustInside * fraction * (xi - inside)).transpose();
    }
  }
}

}  // namespace

ExpansionDesign DesignForRegion(const ResolvedProblem& problem, const Truncation& truncation,
                                Region region, const Vector& inside) {
  const ExpansionOptions& options = problem.problem().expansion;
  const int n = problem.dimension();
  ExpansionDesign design;
  design.basis = std::make_shared<Basis>(std::vector<Germ>(static_cast<size_t>(n), Germ::Uniform()),
                                         truncation);
  const PointSet set = options.points == PointSet::kHammersley ? options.points : PointSet::kHalton;
  design.points = 2 * UnitCubePoints(set, n, PointsFor(problem, *design.basis)).array() - 1;
  MoveInside(problem.prior(), region, inside, design.points);
  design.region = std::move(region);
  design.check_points.resize(0, n);
  design.reference = Vector::Zero(n);
  design.lower = Vector::Constant(n, -1);
  design.upper = Vector::Constant(n, 1);
  design.whole_prior = false;
  return design;
}

void SpreadCheckPoints(const ResolvedProblem& problem, const Vector& inside,
                       ExpansionDesign& design) {
  const int n = problem.dimension(), checks = CheckCount(n);
  const int used = static_cast<int>(design.points.rows());
  // Later points of the sequence differ from the collocation points.
  const Matrix sequence = UnitCubePoints(PointSet::kHalton, n, used + checks);
  design.check_points = 2 * sequence.bottomRows(checks).array() - 1;
  MoveInside(problem.prior(), design.region, inside, design.check_points);
  design.check_costs = Vector::Zero(checks);
}

ExpansionDesign DesignForTails(const ResolvedProblem& problem) {
  const int n = problem.dimension();
  Vector lower(n), upper(n), mean(n);
  for (int j = 0; j < n; ++j) {
    const Germ& germ = problem.prior().germs()[static_cast<size_t>(j)];
    lower[j] = germ.Quantile(kFarTail);
    upper[j] = germ.Quantile(1 - kFarTail);
    mean[j] = germ.Mean();
  }
  const Vector half = 0.5 * (upper - lower);
  ExpansionDesign design = DesignForRegion(problem, FirstTruncation(problem.problem().expansion, n),
                                           Region(0.5 * (lower + upper), half.asDiagonal()), mean);
  SpreadCheckPoints(problem, mean, design);
  design.in_tails = true;
  return design;
}

bool BeginsInTails(const ResolvedProblem& problem) {
  const std::vector<Germ>& germs = problem.prior().germs();
  return problem.problem().expansion.adaptive && problem.dimension() <= kFewForTails &&
         std::ranges::any_of(germs, [](const Germ& germ) { return germ != Germ::Uniform(); });
}

absl::StatusOr<ExpansionDesign> DesignToBeginWith(const ResolvedProblem& problem, bool in_tails) {
  if (in_tails || BeginsInTails(problem)) return DesignForTails(problem);
  return DesignForPrior(problem);
}

PriorMoments MomentsUnderPrior(const Prior& prior, const ExpansionDesign& design) {
  // Gauss's rules with p + 1 nodes for each germ integrate products of polynomials of degree p.
  const int n = prior.dimension(), nodes = design.basis->order() + 1, size = design.basis->size();
  std::vector<GaussRule> rules;
  Eigen::Index count = 1;
  for (const Germ& germ : prior.germs()) {
    rules.push_back(MakeGaussRule(germ, nodes));
    count *= nodes;
  }
  PriorMoments moments{Vector::Zero(size), Matrix::Zero(size, size)};
  Vector xi(n), phi(size);
  for (Eigen::Index i = 0; i < count; ++i) {
    double weight = 1;
    Eigen::Index place = i;
    for (int j = 0; j < n; ++j, place /= nodes) {
      const GaussRule& rule = rules[static_cast<size_t>(j)];
      xi[j] = rule.nodes[place % nodes];
      weight *= rule.weights[place % nodes];
    }
    design.basis->Evaluate(design.region.ToLocal(xi), phi);
    moments.mean += weight * phi;
    moments.covariance += weight * phi * phi.transpose();
  }
  moments.covariance -= moments.mean * moments.mean.transpose();
  return moments;
}

Vector NearestInside(const Prior& prior, const Vector& xi) {
  Vector inside = xi;
  for (Eigen::Index j = 0; j < xi.size(); ++j) {
    const double width = prior.upper()[j] - prior.lower()[j];
    const double off = (1 - kJustInside) * (std::isfinite(width) ? width : 1);
    inside[j] = std::clamp(xi[j], prior.lower()[j] + off, prior.upper()[j] - off);
  }
  return inside;
}

Vector MiddleInside(const Prior& prior, const Region& region) {
  Vector middle = NearestInside(prior, region.centre());
  const Vector reach = region.axes().cwiseAbs().rowwise().sum();
  const Vector first = region.centre() - reach, last = region.centre() + reach;
  for (Eigen::Index j = 0; j < middle.size(); ++j) {
    const double low = std::max(prior.lower()[j], first[j]);
    const double high = std::min(prior.upper()[j], last[j]);
    const bool is_cut = low > first[j] || high < last[j];
    if (is_cut && low < high) middle[j] = 0.5 * (low + high);
  }
  return middle;
}

Region RegionOfParticles(const Matrix& xis) {
  const auto [mean, covariance] = SummaryOf(xis);
  const Matrix centred = xis.rowwise() - mean.transpose();
  // Scaling to unit variances makes the axes principal whatever the scales of the germs are.
  const Vector scale = covariance.diagonal().cwiseSqrt().cwiseMax(kMinHalfWidth);
  const Matrix correlation =
      scale.cwiseInverse().asDiagonal() * covariance * scale.cwiseInverse().asDiagonal();
  Matrix axes = DecomposeSymmetric(correlation).vectors;
  if (axes.rows() == 2) {
    // The axes of a 2 × 2 correlation matrix are (−1, 1) and (1, 1), whatever the correlation is,
    // and the decomposition leaves their signs to rounding.
    for (auto axis : axes.colwise()) axis *= axis[1] < 0 ? -1 : 1;
  }
  const Matrix along = centred * scale.cwiseInverse().asDiagonal() * axes;
  const Vector low = along.colwise().minCoeff().transpose();
  const Vector high = along.colwise().maxCoeff().transpose();
  const Vector half = (0.5 * kMargin * (high - low)).cwiseMax(kMinHalfWidth);
  const Vector centre = mean + scale.asDiagonal() * (axes * (0.5 * (low + high)));
  return Region(centre, scale.asDiagonal() * axes * half.asDiagonal());
}

Region TrustedRegion(const ExpansionDesign& design) {
  return Region(design.region.ToGerm(design.Middle()),
                design.region.axes() * design.HalfWidths().asDiagonal());
}

void SamplingBox(const ExpansionDesign& design, Vector& lower, Vector& upper) {
  const Vector half = kOvershoot * design.HalfWidths();
  lower = design.Middle() - half;
  upper = design.Middle() + half;
}

std::vector<int> LeaningAxes(const ExpansionDesign& design, const Prior& prior,
                             const Element& element, const Matrix& etas, double fraction) {
  const Matrix units = InBoxUnits(design, etas);
  const Region trusted = TrustedRegion(design);
  std::vector<int> leaning;
  for (Eigen::Index j = 0; j < units.cols(); ++j) {
    int at_edge = 0;
    int goes_on = 0;
    for (Eigen::Index i = 0; i < units.rows(); ++i) {
      if (std::abs(units(i, j)) <= kEdge) continue;
      ++at_edge;
      Vector beyond = units.row(i).transpose();
      beyond[j] *= kBeyondEdge;
      const Vector xi = trusted.ToGerm(beyond);
      if (prior.Contains(xi) && element.Contains(xi)) ++goes_on;
    }
    if (at_edge > fraction * static_cast<double>(units.rows()) &&
        goes_on > kGoesOnFraction * at_edge) {
      leaning.push_back(static_cast<int>(j));
    }
  }
  return leaning;
}

Element WithinKnown(const ResolvedProblem& problem, const Element& element) {
  const EndedRuns* ended = problem.ended_runs();
  if (ended == nullptr) return element;
  std::vector<Element::Bound> bounds = element.bounds();
  const std::vector<int> shared = problem.SharedParameters();
  const Matrix to_local = Inverse(ended->region.axes());
  for (Eigen::Index i = 0; i < to_local.rows(); ++i) {
    for (const double side : {1.0, -1.0}) {
      Element::Bound bound{Vector::Zero(problem.dimension()), 0};
      bound.normal(shared) = side * to_local.row(i).transpose();
      bound.offset = kOvershoot + bound.normal(shared).dot(ended->region.centre());
      bounds.push_back(std::move(bound));
    }
  }
  return Element(std::move(bounds));
}

Region WidenedRegion(const ExpansionDesign& design, const Matrix& etas,
                     const std::vector<int>& axes, double factor) {
  const Region trusted = TrustedRegion(design);
  const Vector mean = InBoxUnits(design, etas).colwise().mean().transpose();
  Vector shift = Vector::Zero(mean.size());
  Matrix widened = trusted.axes();
  for (const int j : axes) {
    shift[j] = mean[j];
    widened.col(j) *= factor;
  }
  return Region(trusted.ToGerm(shift), widened);
}

}  // namespace polyest::internal
