#include "core/estimator/expansion/mode_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/bayes/cost_minima.h"
#include "core/bayes/domain_cover.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/expansion/search_domain.h"

namespace polyest::internal {
namespace {

constexpr int kStarts = 6;
// Points of the cover: so many for each parameter, and at most.
constexpr int kCoverPerParameter = 1024, kMaxCover = 4096;
// Number of points of the cover, and of the guesses, from which starts are taken.
constexpr Eigen::Index kBest = 256;
// Another minimum, or a distant point, matters when its cost exceeds the least one by less than the
// mean excess of a draw, n/2, plus this: e^−8 ≈ 3·10⁻⁴.
constexpr double kNegligibleCost = 8;
constexpr double kReach = 4;  // reach of the Gaussian's points beyond √n, in standard deviations
constexpr double kMaxDecrement = 1e-3;
constexpr double kOnBound = 1e-6;  // fraction of the box's width
// Where there are several minima, more are searched, each time from so many starts that are spread
// over so many more of the cover's best points.
constexpr int kMaxSearches = 4, kStartsOfSearch = 24;
constexpr Eigen::Index kBestOfSearch = 1024;
// They are also searched from where the first so many of them let others be expected, unless one is
// within this fraction of the box's width there.
constexpr size_t kMaxMinimaOfCorners = 24;
constexpr double kNearMinimum = 0.01;
// The part of the guesses that may lie out of the modes' reach, in the tails of one, at most.
constexpr double kMaxBeyondAtFirst = 0.1;

// Returns the indices of the finite costs, lowest first, `max_count` of them at most.
std::vector<Eigen::Index> Lowest(const Vector& costs, Eigen::Index max_count) {
  std::vector<Eigen::Index> order;
  for (Eigen::Index i = 0; i < costs.size(); ++i) {
    if (std::isfinite(costs[i])) order.push_back(i);
  }
  const auto better = [&](Eigen::Index a, Eigen::Index b) { return costs[a] < costs[b]; };
  const auto best = std::min(order.size(), static_cast<size_t>(max_count));
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(best), order.end(),
                    better);
  order.resize(best);
  return order;
}

}  // namespace

ModeSearch::ModeSearch(const Cost& cost, const ExpansionDesign& design, const Matrix& guesses,
                       const Stop& stop)
    : cost_(cost), guesses_(guesses), stop_(stop), search_(SearchOf(cost, design)) {
  SamplingBox(design, lower_, upper_);
  Look();
}

// Computes the costs of the cover and the guesses, and the minima found from the best of them.
void ModeSearch::Look() {
  const int count = std::min(kMaxCover, kCoverPerParameter * cost_.dimension());
  const Matrix cover =
      CoverOfDomain(cost_.region(), cost_.prior(), lower_, upper_, guesses_, count);
  known_.etas.resize(count + guesses_.rows(), cost_.dimension());
  known_.etas << cover, guesses_;
  const DifferentialEvolution box(cost_, lower_, upper_, 0);
  box.Evaluate(known_.etas, known_.costs);
  cover_ = count;
  const Matrix covering = BestOf(0, count, kStarts, kBest);
  const Matrix guessed = BestOf(count, guesses_.rows(), kStarts, kBest);
  Matrix starts(covering.rows() + guessed.rows(), cost_.dimension());
  starts << covering, guessed;
  if (starts.rows() == 0) return;
  minima_ = FindMinimaOf(cost_, search_, starts, stop_);
}

size_t ModeSearch::CountOfMinima() const {
  if (minima_.empty()) return 0;
  const double negligible = NegligibleFrom();
  return static_cast<size_t>(std::ranges::count_if(
      minima_, [&](const Minimum& minimum) { return minimum.value < negligible; }));
}

std::optional<Matrix> ModeSearch::FactorOfOnlyMode() const {
  if (CountOfMinima() != 1) return std::nullopt;
  const Minimum& minimum = minima_.front();
  std::optional<Matrix> factor = FactorAt(minimum.point);
  if (!factor || !PointsBeyond({ModeAt(minimum.point, minimum.value, *factor)}).empty()) {
    return std::nullopt;
  }
  return factor;
}

std::optional<std::vector<GaussianMode>> ModeSearch::FindModes() {
  if (!Modes()) return std::nullopt;  // others would not give these their Gaussians
  FindMore();
  std::optional<std::vector<GaussianMode>> modes = Modes();
  if (!modes) return std::nullopt;
  const std::vector<Eigen::Index> beyond = PointsBeyond(*modes);
  if (!beyond.empty()) {
    const Matrix starts =
        SpreadStarts(known_.etas(beyond, Eigen::all), known_.costs(beyond), kStarts);
    if (FindsOthers(starts)) modes = Modes();
    if (!modes) return std::nullopt;
  }
  if (!Reach(*modes, kMaxBeyondAtFirst)) return std::nullopt;
  modes->push_back(AroundAll(*modes));
  return modes;
}

bool ModeSearch::Reach(const std::vector<GaussianMode>& modes, double part) const {
  const std::vector<Eigen::Index> beyond = PointsBeyond(modes);
  if (beyond.empty()) return true;
  return beyond.front() >= cover_ &&
         static_cast<double>(beyond.size()) <= part * static_cast<double>(guesses_.rows());
}

// Returns so many starts, spread over the best of the known points [first, first + count); none
// if the cost is finite at none of them.
Matrix ModeSearch::BestOf(Eigen::Index first, Eigen::Index count, int starts,
                          Eigen::Index max_best) const {
  std::vector<Eigen::Index> order = Lowest(known_.costs.segment(first, count), max_best);
  if (order.empty()) return Matrix(0, cost_.dimension());
  for (Eigen::Index& i : order) i += first;
  return SpreadStarts(known_.etas(order, Eigen::all), known_.costs(order), starts);
}

// The cost from which on a minimum or a point does not matter.
double ModeSearch::NegligibleFrom() const {
  return minima_.front().value + 0.5 * cost_.dimension() + kNegligibleCost;
}

// Searches minima from these starts, too. Returns whether there are others that matter.
bool ModeSearch::FindsOthers(const Matrix& starts) {
  const size_t before = CountOfMinima();
  std::ranges::move(FindMinimaOf(cost_, search_, starts, stop_), std::back_inserter(minima_));
  minima_ = DistinctMinima(std::move(minima_), search_, MinimizerOptions());
  return CountOfMinima() > before;
}

// Searches further minima, from more and more of the cover's points and from where the modes of a
// posterior that is a product would be, until two searches in turn find none.
void ModeSearch::FindMore() {
  int in_vain = 0;
  for (int search = 1; search <= kMaxSearches && in_vain < 2 && stop_.Check().ok(); ++search) {
    const Matrix covering = BestOf(0, cover_, search * kStartsOfSearch, search * kBestOfSearch);
    const Matrix corners = Corners();
    // There are fewer where the cost is finite at hardly any point of the cover.
    const Eigen::Index fresh = std::min<Eigen::Index>(kStartsOfSearch, covering.rows());
    Matrix starts(fresh + corners.rows(), cost_.dimension());
    if (starts.rows() == 0) return;
    starts << covering.bottomRows(fresh), corners;
    in_vain = FindsOthers(starts) ? 0 : in_vain + 1;
  }
}

// Returns the best of the points η_i + η_j − η_k for the minima η: the fourth corners of
// parallelograms of which three are known. At most as many as a search has starts.
Matrix ModeSearch::Corners() const {
  const size_t count = std::min<size_t>(CountOfMinima(), kMaxMinimaOfCorners);
  std::vector<Vector> found;
  for (size_t k = 0; k < count; ++k) {
    for (size_t i = 0; i < count; ++i) {
      for (size_t j = i + 1; i != k && j < count; ++j) {
        if (j == k) continue;
        Vector corner = minima_[i].point + minima_[j].point;
        corner -= minima_[k].point;
        if (!IsKnown(corner, count)) found.push_back(std::move(corner));
      }
    }
  }
  if (found.empty()) return Matrix(0, cost_.dimension());
  Matrix corners(std::ssize(found), cost_.dimension());
  for (size_t i = 0; i < found.size(); ++i) {
    corners.row(static_cast<Eigen::Index>(i)) = found[i].transpose();
  }
  Vector costs;
  DifferentialEvolution(cost_, lower_, upper_, 0).Evaluate(corners, costs);
  return corners(Lowest(costs, kStartsOfSearch), Eigen::all);
}

// Whether the point is nearer to one of the first so many minima than a hundredth of the box.
bool ModeSearch::IsKnown(const Vector& point, size_t count) const {
  const Vector near = kNearMinimum * (search_.upper - search_.lower);
  return std::any_of(minima_.begin(), minima_.begin() + static_cast<std::ptrdiff_t>(count),
                     [&](const Minimum& minimum) {
                       return ((point - minimum.point).array().abs() <= near.array()).all();
                     });
}

// Returns a Gaussian for each minimum that matters; nothing if the curvature does not give one.
std::optional<std::vector<GaussianMode>> ModeSearch::Modes() const {
  std::vector<GaussianMode> modes;
  for (size_t m = 0; m < CountOfMinima(); ++m) {
    const Minimum& minimum = minima_[m];
    const std::optional<Matrix> factor = FactorAt(minimum.point);
    if (!factor) return std::nullopt;
    modes.push_back(ModeAt(minimum.point, minimum.value, *factor));
  }
  return modes;
}

// Returns L of H = L Lᵀ at a minimum, if it lies inside and is one.
std::optional<Matrix> ModeSearch::FactorAt(const Vector& eta) const {
  if (OnBound(eta)) return std::nullopt;
  Vector gradient(eta.size());
  cost_.EvaluateWithGradient(eta, gradient);
  const Matrix hessian = cost_.Hessian(eta);
  if (!hessian.allFinite() || !gradient.allFinite()) return std::nullopt;
  const CholeskyFactor cholesky(hessian);
  if (!cholesky.positive_definite()) return std::nullopt;
  // gᵀH⁻¹g/2 = ‖L⁻¹g‖²/2
  if (!(0.5 * cholesky.SolveLower(gradient).squaredNorm() < kMaxDecrement)) {
    return std::nullopt;
  }
  return cholesky.Lower();
}

// Whether the point is on an edge of the box or of Ω.
bool ModeSearch::OnBound(const Vector& eta) const {
  const Vector room = kOnBound * (search_.upper - search_.lower);
  if (((eta - search_.lower).array() < room.array()).any()) return true;
  if (((search_.upper - eta).array() < room.array()).any()) return true;
  for (Eigen::Index i = 0; i < search_.bound.size(); ++i) {
    const auto row = search_.constraint.row(i);
    if (search_.bound[i] - row.dot(eta) < row.cwiseAbs().dot(room)) return true;
  }
  return false;
}

// Returns the known points that matter and that none of the Gaussians reaches.
std::vector<Eigen::Index> ModeSearch::PointsBeyond(const std::vector<GaussianMode>& modes) const {
  const double negligible = NegligibleFrom();
  std::vector<Eigen::Index> near;  // in cost
  for (Eigen::Index i = 0; i < known_.costs.size(); ++i) {
    if (known_.costs[i] < negligible) near.push_back(i);
  }
  const double reach = std::sqrt(cost_.dimension()) + kReach;
  for (const GaussianMode& mode : modes) {
    // r = ‖Lᵀ(η − η̂)‖
    const Matrix away = known_.etas(near, Eigen::all).rowwise() - mode.centre.transpose();
    const Vector radii = (away * mode.factor).rowwise().norm();
    std::vector<Eigen::Index> beyond;
    for (size_t i = 0; i < near.size(); ++i) {
      if (!(radii[static_cast<Eigen::Index>(i)] < reach)) beyond.push_back(near[i]);
    }
    near = std::move(beyond);
  }
  return near;
}

}  // namespace polyest::internal
