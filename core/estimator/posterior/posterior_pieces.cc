#include "core/estimator/posterior/posterior_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/bayes/cost_minima.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/expansion/germ_summary.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/cost_slice.h"

namespace polyest::internal {
namespace {

using Rows = std::vector<Eigen::Index>;

constexpr int kStartsOfPieces = 12;
constexpr double kMinShare = 0.02;  // fraction of the particles
constexpr double kMinGap = 1;       // in standard deviations within the sets
constexpr int kRefinements = 4;     // number of refinements of a hyperplane
constexpr double kMaxGrowth = 2;    // of the volume when pieces are united

struct Gap {
  Vector normal;
  double offset = 0;  // normalᵀη = offset in the middle of the gap
  Rows below, above;
};

Matrix Covariance(const Matrix& points) { return SummaryOf(points).covariance; }

class PieceFinder {
 public:
  PieceFinder(const Cost& cost, const ExpansionDesign& design, const Matrix& particles)
      : region_(design.region),
        element_(design.element),
        particles_(design.region.ManyToLocal(particles)),
        search_(SearchOf(cost, design)),
        least_(static_cast<size_t>(std::ceil(kMinShare * static_cast<double>(particles.rows())))) {
    cost.EvaluateMany(particles_, costs_);
    const Matrix starts = SpreadStarts(particles_, costs_, kStartsOfPieces);
    for (Minimum& minimum : FindMinimaOf(cost, search_, starts, Stop())) {
      if (minimum.converged) minima_.push_back(std::move(minimum));
    }
  }

  struct Part {
    Element element;
    Rows rows;
  };

  const Vector& costs() const { return costs_; }

  std::vector<Part> Run() {
    Rows all(static_cast<size_t>(particles_.rows()));
    for (size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Eigen::Index>(i);
    Divide({element_, std::move(all)}, minima_);
    return std::move(parts_);
  }

 private:
  void Divide(const Part& part, const std::vector<Minimum>& minima) {
    for (size_t a = 0; a < minima.size(); ++a) {
      for (size_t b = a + 1; b < minima.size(); ++b) {
        const std::optional<Gap> gap = GapBetween(part.rows, minima[a].point, minima[b].point);
        if (!gap || !HasWall(*gap, minima)) continue;
        std::vector<Minimum> below, above;
        for (const Minimum& minimum : minima) {
          (gap->normal.dot(minimum.point) < gap->offset ? below : above).push_back(minimum);
        }
        const auto [lower, upper] = Elements(part.element, *gap);
        Divide({lower, gap->below}, below);
        Divide({upper, gap->above}, above);
        return;
      }
    }
    parts_.push_back(part);
  }

  // Divides the element by the gap's hyperplane, from local to germ coordinates: with
  // η = axes⁻¹ (ξ − centre), normalᵀη = (axes⁻ᵀ normal)ᵀ (ξ − centre).
  std::pair<Element, Element> Elements(const Element& element, const Gap& gap) const {
    const Vector normal = Inverse(region_.axes()).transpose() * gap.normal;
    return element.Divide(normal, gap.offset + normal.dot(region_.centre()));
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
      Assign(rows, gap);
      if (std::min(gap.below.size(), gap.above.size()) < least_) return std::nullopt;
      width = Discriminate(rows, gap);
    }
    if (!(width >= kMinGap)) return std::nullopt;
    Assign(rows, gap);
    return gap;
  }

  void Assign(const Rows& rows, Gap& gap) const {
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

  const Region& region_;
  const Element& element_;
  const Matrix particles_;  // local
  const MinimizationProblem search_;
  const size_t least_;
  Vector costs_;  // of the particles
  std::vector<Minimum> minima_;
  std::vector<Part> parts_;
};

}  // namespace

Matrix PooledParticles(const std::vector<Matrix>& particles, const std::vector<double>& weights) {
  std::vector<Matrix> shares;
  Eigen::Index count = 0;
  for (size_t k = 0; k < particles.size(); ++k) {
    const Eigen::Index own = particles[k].rows();
    const auto share = static_cast<Eigen::Index>(std::ceil(weights[k] * static_cast<double>(own)));
    // Every so many-th, since the particles may be ordered.
    const Eigen::Index stride = std::max<Eigen::Index>(1, own / std::max<Eigen::Index>(1, share));
    shares.push_back(particles[k](Eigen::seqN(0, share, stride), Eigen::all));
    count += share;
  }
  Matrix pooled(count, particles.front().cols());
  Eigen::Index row = 0;
  for (const Matrix& share : shares) {
    pooled.middleRows(row, share.rows()) = share;
    row += share.rows();
  }
  return pooled;
}

std::optional<Piece> UnitePieces(const std::vector<Matrix>& particles,
                                 const std::vector<double>& weights) {
  // Components of which none has evidence have no particles.
  if (std::ranges::any_of(particles, [](const Matrix& own) { return own.rows() == 0; })) {
    return std::nullopt;
  }
  Vector log_volumes(std::ssize(particles));
  for (size_t k = 0; k < particles.size(); ++k) {
    log_volumes[static_cast<Eigen::Index>(k)] = RegionOfParticles(particles[k]).LogVolume();
  }
  Matrix pooled = PooledParticles(particles, weights);
  Region region = RegionOfParticles(pooled);
  const double largest = log_volumes.maxCoeff();
  const double together = largest + std::log((log_volumes.array() - largest).exp().sum());
  if (region.LogVolume() > std::log(kMaxGrowth) + together) return std::nullopt;
  return Piece{Element(), std::move(region), std::move(pooled), Vector()};
}

std::vector<Piece> FindPieces(const Cost& cost, const ExpansionDesign& design,
                              const Matrix& particles) {
  if (particles.rows() < kMinParticlesForPieces) {
    return {{design.element, TrustedRegion(design), particles, Vector()}};
  }
  PieceFinder finder(cost, design, particles);
  std::vector<Piece> pieces;
  for (PieceFinder::Part& part : finder.Run()) {
    Matrix own = particles(part.rows, Eigen::all);
    Region region = RegionOfParticles(own);
    pieces.push_back(
        {std::move(part.element), std::move(region), std::move(own), finder.costs()(part.rows)});
  }
  return pieces;
}

}  // namespace polyest::internal
