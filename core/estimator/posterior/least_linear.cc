#include "core/estimator/posterior/least_linear.h"

#include <algorithm>
#include <utility>

#include "core/chaos/multi_index.h"
#include "core/common/infeasible.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/expansion/replay.h"

namespace polyest::internal {
namespace {

constexpr Eigen::Index kLines = 4;         // for each germ
constexpr Eigen::Index kPointsOfLine = 6;  // three more than a quadratic has coefficients
// What rounding and errors of integration leave of a quadratic, relative to χ².
constexpr double kLeftByRounding = 1e-4;

// Returns the lines, germ by germ, a point a row: across the region and Ω, through points halfway
// between the region's centre and the expansion's own points, which are in Ω.
Matrix LinesIn(const Prior& prior, const ExpansionDesign& design) {
  const Eigen::Index n = design.points.cols();
  const Region region = TrustedRegion(design);
  const Vector inside = NearestInside(prior, region.centre());
  const Matrix directions = Inverse(region.axes());  // column i is that of germ i
  const Vector steps = (Vector::LinSpaced(kPointsOfLine, 0.5, kPointsOfLine - 0.5)) / kPointsOfLine;
  Matrix xis(n * kLines * kPointsOfLine, n);
  for (Eigen::Index germ = 0, row = 0; germ < n; ++germ) {
    const auto way = directions.col(germ).array();
    for (Eigen::Index line = 0; line < kLines; ++line, row += kPointsOfLine) {
      const auto own = design.points.row(line * design.points.rows() / kLines).transpose();
      const Vector xi = 0.5 * (inside + design.region.ToGerm(own));
      const Vector eta = region.ToLocal(xi);
      // |η + s way| ≤ 1
      const double back = ((1 + way.sign() * eta.array()) / way.abs()).minCoeff();
      const double forth = ((1 - way.sign() * eta.array()) / way.abs()).minCoeff();
      const double lower = std::max(xi[germ] - std::max(0.0, back), prior.lower()[germ]);
      const double upper = std::min(xi[germ] + std::max(0.0, forth), prior.upper()[germ]);
      xis.middleRows(row, kPointsOfLine) = xi.transpose().replicate(kPointsOfLine, 1);
      xis.col(germ).segment(row, kPointsOfLine) = lower + (upper - lower) * steps.array();
    }
  }
  return xis;
}

// Returns what a quadratic leaves of the values at the points of a line: the sum of its squares.
double LeftOfQuadratic(const Vector& values) {
  Matrix terms(kPointsOfLine, 3);
  terms.col(0).setOnes();
  terms.col(1) = Vector::LinSpaced(kPointsOfLine, -1, 1);
  terms.col(2) = terms.col(1).cwiseAbs2();
  const double left = (values - terms * SolveByPivotedQr(terms, values).solution).squaredNorm();
  return left > kLeftByRounding * kLeftByRounding * values.squaredNorm() ? left : 0;
}

// Returns the sum over the germ's lines and all channels. Lines with trajectories that could not be
// integrated do not count.
double LeftOfLines(const RegionalExpansion& lines, Eigen::Index germ) {
  std::vector<bool> kept(static_cast<size_t>(lines.points()), false);
  for (const int point : lines.kept_points()) kept[static_cast<size_t>(point)] = true;
  const Matrix chi_squared = lines.absorbed().PointChiSquared();
  double left = 0;
  for (Eigen::Index line = 0; line < kLines; ++line) {
    const Eigen::Index first = (germ * kLines + line) * kPointsOfLine;
    if (!std::all_of(kept.begin() + first, kept.begin() + first + kPointsOfLine,
                     [](bool one) { return one; })) {
      continue;
    }
    for (Eigen::Index c = 0; c < chi_squared.cols(); ++c) {
      left += LeftOfQuadratic(chi_squared.col(c).segment(first, kPointsOfLine));
    }
  }
  return left;
}

}  // namespace

absl::StatusOr<LeastLinear> FindLeastLinear(const ResolvedProblem& problem,
                                            const RegionalExpansion& expansion,
                                            const SampleStore& store, int64_t rows, int threads,
                                            const Stop& stop) {
  const ExpansionDesign& present = expansion.design();
  const Region region = TrustedRegion(present);
  // A constant is all that is fitted to the trajectories.
  ExpansionDesign design = DesignForRegion(problem, Truncation{.order = 0}, region,
                                           NearestInside(problem.prior(), region.centre()));
  design.points = region.ManyToLocal(LinesIn(problem.prior(), present));
  LeastLinear found;
  const auto lines = Replay(problem, std::move(design), expansion.noise().ForNewExpansion(), store,
                            rows, threads, stop);
  if (IsInfeasible(lines.status())) return found;
  if (!lines.ok()) return lines.status();
  found.propagated_rows = (*lines)->propagated_rows();
  double most = 0;
  for (Eigen::Index germ = 0; germ < problem.dimension(); ++germ) {
    const double left = LeftOfLines(**lines, germ);
    if (left > most) found.germ = germ;
    most = std::max(most, left);
  }
  return found;
}

}  // namespace polyest::internal
