#include "core/bayes/newton_starts.h"

#include <algorithm>
#include <cmath>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr int kMaxSteps = 25;
constexpr int kMaxHalvings = 6;
constexpr double kSufficient = 1e-4;     // of the predicted decrease: Armijo's condition
constexpr double kConvergedStep = 1e-9;  // in widths of the box
// A decrease that the rounding of the cost hides is not tested any more.
constexpr double kRounding = 1e-12;

bool IsInside(const MinimizationProblem& problem, const Vector& eta) {
  if ((eta.array() <= problem.lower.array()).any()) return false;
  if ((eta.array() >= problem.upper.array()).any()) return false;
  return problem.bound.size() == 0 ||
         ((problem.constraint * eta).array() < problem.bound.array()).all();
}

}  // namespace

std::optional<Vector> MinimumByNewton(const Cost& cost, const MinimizationProblem& problem,
                                      const Vector& start) {
  Vector eta = start;
  const Vector width = problem.upper - problem.lower;
  Vector gradient(eta.size());
  for (int step = 0; step < kMaxSteps && IsInside(problem, eta); ++step) {
    const double value = cost.EvaluateWithGradient(eta, gradient).total;
    if (!std::isfinite(value) || !gradient.allFinite()) return std::nullopt;
    const Matrix hessian = cost.Hessian(eta);
    if (!hessian.allFinite()) return std::nullopt;
    const CholeskyFactor factor(hessian);
    if (!factor.positive_definite()) return std::nullopt;
    const Vector move = -factor.Solve(gradient);
    if (!move.allFinite()) return std::nullopt;
    if ((move.array().abs() <= kConvergedStep * width.array()).all()) return eta;
    const double slope = gradient.dot(move);
    double fraction = 1;
    const bool hidden = -slope <= kRounding * std::abs(value);
    for (int halving = 0; !hidden && halving < kMaxHalvings; ++halving, fraction /= 2) {
      const Vector next = eta + fraction * move;
      if (IsInside(problem, next) &&
          cost.Evaluate(next).total <= value + kSufficient * fraction * slope) {
        break;
      }
    }
    eta += fraction * move;
    if (hidden) return IsInside(problem, eta) ? std::optional<Vector>(eta) : std::nullopt;
  }
  return std::nullopt;
}

Matrix ImprovedStarts(const Cost& cost, const MinimizationProblem& problem, const Matrix& starts,
                      const MinimizerOptions& options) {
  const Vector same = options.same_point * (problem.upper - problem.lower);
  Matrix improved(starts.rows(), starts.cols());
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < starts.rows(); ++i) {
    const std::optional<Vector> reached = MinimumByNewton(cost, problem, starts.row(i).transpose());
    const Vector eta = reached ? *reached : Vector(starts.row(i).transpose());
    bool known = false;
    for (Eigen::Index k = 0; reached && k < count; ++k) {
      const Vector distance = (improved.row(k).transpose() - eta).cwiseAbs();
      known = known || (distance.array() <= same.array()).all();
    }
    if (!known) improved.row(count++) = eta.transpose();
  }
  return improved.topRows(count);
}

std::vector<Minimum> FindMinimaOf(const Cost& cost, const MinimizationProblem& problem,
                                  const Matrix& starts, const Stop& stop) {
  const MinimizerOptions options;
  return FindMinima(problem, ImprovedStarts(cost, problem, starts, options), options, stop);
}

}  // namespace polyest::internal
