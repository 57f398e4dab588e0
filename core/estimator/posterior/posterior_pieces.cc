#include "core/estimator/posterior/posterior_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/common/linear_algebra.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/cost_slice.h"

namespace polyest::internal {
namespace {

using Rows = std::vector<Eigen::Index>;

constexpr int kStarts = 12;
constexpr double kMinShare = 0.02;  // fraction of the particles
constexpr double kMinGap = 1;       // in standard deviations within the sets
constexpr double kMinWall = 8;      // difference in cost: e^−8 ≈ 3·10⁻⁴
constexpr int kRefinements = 4;     // number of refinements of a hyperplane

struct Gap {
  Vector normal;
  double offset = 0;  // normalᵀη = offset in the middle of the gap
  Rows below, above;
};

Matrix Covariance(const Matrix& points) {
  const Matrix centred = points.rowwise() - points.colwise().mean();
  return centred.transpose() * centred / static_cast<double>(points.rows());
}

class PieceFinder {
 public:
  PieceFinder(const Cost& cost, const ExpansionDesign& design, const Matrix& particles)
      : particles_(design.region.ManyToLocal(particles)),
        search_(SearchOf(cost, design)),
        least_(static_cast<size_t>(std::ceil(kMinShare * static_cast<double>(particles.rows())))) {
    Vector costs;
    cost.EvaluateMany(particles_, costs);
    const Matrix starts = SpreadStarts(particles_, costs, kStarts);
    for (Minimum& minimum : FindMinima(search_, starts, MinimizerOptions(), Stop())) {
      if (minimum.converged) minima_.push_back(std::move(minimum));
    }
  }

  std::vector<Rows> Run() {
    Rows all(static_cast<size_t>(particles_.rows()));
    for (size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Eigen::Index>(i);
    Divide(all, minima_);
    return std::move(pieces_);
  }

 private:
  void Divide(const Rows& rows, const std::vector<Minimum>& minima) {
    for (size_t a = 0; a < minima.size(); ++a) {
      for (size_t b = a + 1; b < minima.size(); ++b) {
        const std::optional<Gap> gap = GapBetween(rows, minima[a].point, minima[b].point);
        if (!gap || !HasWall(*gap, minima)) continue;
        std::vector<Minimum> below, above;
        for (const Minimum& minimum : minima) {
          (gap->normal.dot(minimum.point) < gap->offset ? below : above).push_back(minimum);
        }
        Divide(gap->below, below);
        Divide(gap->above, above);
        return;
      }
    }
    pieces_.push_back(rows);
  }

  // Returns the gap among the rows that Fisher's discriminant finds, starting from the sets nearer
  // to a and to b.
  std::optional<Gap> GapBetween(const Rows& rows, const Vector& a, const Vector& b) const {
    const Matrix points = particles_(rows, Eigen::all);
    const Vector scale = Covariance(points).diagonal().cwiseSqrt();
    if (!(scale.minCoeff() > 0)) return std::nullopt;
    Gap gap;
    // Points of (η − (a + b)/2)ᵀ S⁻² (b − a) = 0 are equally far from a and from b.
    gap.normal = (b - a).cwiseQuotient(scale.cwiseAbs2());
    gap.offset = gap.normal.dot(a + b) / 2;
    double width = 0;
    for (int i = 0; i < kRefinements; ++i) {
      Part(rows, gap);
      if (std::min(gap.below.size(), gap.above.size()) < least_) return std::nullopt;
      width = Discriminate(rows, gap);
    }
    if (!(width >= kMinGap)) return std::nullopt;
    Part(rows, gap);
    return gap;
  }

  void Part(const Rows& rows, Gap& gap) const {
    gap.below.clear();
    gap.above.clear();
    for (const Eigen::Index row : rows) {
      (gap.normal.dot(particles_.row(row)) < gap.offset ? gap.below : gap.above).push_back(row);
    }
  }

  // Recomputes the normal and the offset from the sets. Returns the width of the gap in standard
  // deviations within them.
  double Discriminate(const Rows& rows, Gap& gap) const {
    const Matrix below = particles_(gap.below, Eigen::all);
    const Matrix above = particles_(gap.above, Eigen::all);
    const double share = static_cast<double>(below.rows()) / static_cast<double>(rows.size());
    const Matrix within = share * Covariance(below) + (1 - share) * Covariance(above);
    const CholeskyFactor cholesky(within);
    if (!cholesky.positive_definite()) return 0;
    gap.normal = cholesky.Solve((above.colwise().mean() - below.colwise().mean()).transpose());
    Vector along = particles_(rows, Eigen::all) * gap.normal;
    std::sort(along.begin(), along.end());
    double width = 0;
    for (size_t i = least_; i + least_ <= rows.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      if (along[k] - along[k - 1] <= width) continue;
      width = along[k] - along[k - 1];
      gap.offset = 0.5 * (along[k] + along[k - 1]);
    }
    return width / std::sqrt(gap.normal.dot(within * gap.normal));
  }

  bool HasWall(const Gap& gap, const std::vector<Minimum>& minima) const {
    double below = std::numeric_limits<double>::infinity(), above = below;
    std::vector<Vector> starts;
    for (const Minimum& minimum : minima) {
      double& least = gap.normal.dot(minimum.point) < gap.offset ? below : above;
      least = std::min(least, minimum.value);
      starts.push_back(minimum.point);
    }
    if (!std::isfinite(below) || !std::isfinite(above)) return false;
    starts.push_back(Nearest(gap.below, gap));
    starts.push_back(Nearest(gap.above, gap));
    const std::optional<Minimum> wall =
        CostSlice(search_, gap.normal).Minimize(gap.offset, starts, Stop());
    return !wall || wall->value >= std::max(below, above) + kMinWall;
  }

  Vector Nearest(const Rows& rows, const Gap& gap) const {
    const auto distance = [&](Eigen::Index row) {
      return std::abs(gap.normal.dot(particles_.row(row)) - gap.offset);
    };
    const auto nearest =
        std::min_element(rows.begin(), rows.end(),
                         [&](Eigen::Index i, Eigen::Index j) { return distance(i) < distance(j); });
    return particles_.row(*nearest).transpose();
  }

  const Matrix particles_;  // local
  const MinimizationProblem search_;
  const size_t least_;
  std::vector<Minimum> minima_;
  std::vector<Rows> pieces_;
};

}  // namespace

std::vector<Matrix> FindPieces(const Cost& cost, const ExpansionDesign& design,
                               const Matrix& particles) {
  if (particles.rows() < kMinParticlesForPieces) return {particles};
  std::vector<Matrix> pieces;
  for (const Rows& rows : PieceFinder(cost, design, particles).Run()) {
    pieces.push_back(particles(rows, Eigen::all));
  }
  return pieces;
}

}  // namespace polyest::internal
