#include "core/estimator/expansion/guarded_importance.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/bayes/cost_minima.h"
#include "core/bayes/differential_evolution.h"
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
constexpr double kMinEffective = 0.5;
constexpr double kHeaviest = 0.01;

class GuardedImportance {
 public:
  GuardedImportance(const Cost& cost, const ExpansionDesign& design, const Matrix& guesses,
                    const Stop& stop)
      : cost_(cost), guesses_(guesses), stop_(stop), search_(SearchOf(cost, design)) {
    SamplingBox(design, lower_, upper_);
  }

  GuardedDraws Run(int points) {
    Look();
    if (stop_.Check().ok()) DrawByImportance(points);
    return std::move(result_);
  }

 private:
  // Computes the costs of the cover and the guesses, and the minima found from the best of them.
  void Look() {
    const int count = std::min(kMaxCover, kCoverPerParameter * cost_.dimension());
    const Matrix cover =
        CoverOfDomain(cost_.region(), cost_.prior(), lower_, upper_, guesses_, count);
    known_.etas.resize(count + guesses_.rows(), cost_.dimension());
    known_.etas << cover, guesses_;
    const DifferentialEvolution box(cost_, lower_, upper_, 0);
    box.Evaluate(known_.etas, known_.costs);
    Matrix starts(0, cost_.dimension());
    AddStarts(0, count, starts);
    AddStarts(count, guesses_.rows(), starts);
    if (starts.rows() == 0) return;
    result_.minima = FindMinimaOf(cost_, search_, starts, stop_);
  }

  // Adds starts spread over the best of the known points [first, first + count).
  void AddStarts(Eigen::Index first, Eigen::Index count, Matrix& starts) const {
    std::vector<Eigen::Index> order;
    for (Eigen::Index i = first; i < first + count; ++i) {
      if (std::isfinite(known_.costs[i])) order.push_back(i);
    }
    if (order.empty()) return;
    const auto better = [&](Eigen::Index a, Eigen::Index b) {
      return known_.costs[a] < known_.costs[b];
    };
    const auto best = std::min(order.size(), static_cast<size_t>(kBest));
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(best), order.end(),
                      better);
    order.resize(best);
    const Matrix points = known_.etas(order, Eigen::all);
    const Vector costs = known_.costs(order);
    const Eigen::Index before = starts.rows();
    starts.conservativeResize(before + kStarts, starts.cols());
    starts.bottomRows(kStarts) = SpreadStarts(points, costs, kStarts);
  }

  void DrawByImportance(int points) {
    const std::optional<Matrix> factor = GaussianFactor();
    if (!factor) return;
    WeightedDraws drawn =
        ImportanceSample(cost_, lower_, upper_, result_.minima.front().point, *factor, points);
    if (drawn.effective_size < kMinEffective * points || drawn.weights.maxCoeff() > kHeaviest) {
      return;
    }
    result_.draws = std::move(drawn);
  }

  // Returns L of H = L Lᵀ if the curvature's Gaussian may approximate the posterior, else nothing.
  std::optional<Matrix> GaussianFactor() const {
    const std::vector<Minimum>& minima = result_.minima;
    if (minima.empty()) return std::nullopt;
    const double most = minima.front().value + 0.5 * cost_.dimension() + kNegligibleCost;
    if (minima.size() > 1 && minima[1].value < most) return std::nullopt;
    const Vector& eta = minima.front().point;
    if (OnBound(eta)) return std::nullopt;
    Vector gradient(eta.size());
    cost_.EvaluateWithGradient(eta, gradient);
    const Matrix hessian = cost_.Hessian(eta);
    if (!hessian.allFinite() || !gradient.allFinite()) return std::nullopt;
    const CholeskyFactor cholesky(hessian);
    if (!cholesky.positive_definite()) return std::nullopt;
    const Matrix factor = cholesky.Lower();
    // gᵀH⁻¹g/2 = ‖L⁻¹g‖²/2
    if (!(0.5 * cholesky.SolveLower(gradient).squaredNorm() < kMaxDecrement)) {
      return std::nullopt;
    }
    const double reach = std::sqrt(cost_.dimension()) + kReach;
    std::vector<Eigen::Index> near;  // in cost
    for (Eigen::Index i = 0; i < known_.costs.size(); ++i) {
      if (known_.costs[i] < most) near.push_back(i);
    }
    // r = ‖Lᵀ(η − η̂)‖
    const Matrix away = known_.etas(near, Eigen::all).rowwise() - eta.transpose();
    const Vector radii = (away * factor).rowwise().norm();
    if (!(radii.array() < reach).all()) return std::nullopt;
    return factor;
  }

  bool OnBound(const Vector& eta) const {
    const Vector room = kOnBound * (search_.upper - search_.lower);
    if (((eta - search_.lower).array() < room.array()).any()) return true;
    if (((search_.upper - eta).array() < room.array()).any()) return true;
    for (Eigen::Index i = 0; i < search_.bound.size(); ++i) {
      const auto row = search_.constraint.row(i);
      if (search_.bound[i] - row.dot(eta) < row.cwiseAbs().dot(room)) return true;
    }
    return false;
  }

  const Cost& cost_;
  const Matrix& guesses_;
  const Stop& stop_;
  const MinimizationProblem search_;
  Vector lower_, upper_;
  Particles known_;  // the cover, then the guesses
  GuardedDraws result_;
};

}  // namespace

GuardedDraws DrawIfNearlyGaussian(const Cost& cost, const ExpansionDesign& design,
                                  const Matrix& guesses, int points, const Stop& stop) {
  return GuardedImportance(cost, design, guesses, stop).Run(points);
}

}  // namespace polyest::internal
