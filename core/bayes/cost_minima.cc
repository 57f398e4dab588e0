#include "core/bayes/cost_minima.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr int kMaxSteps = 25;  // and two more for each parameter, whose bounds may become active
constexpr int kMaxHalvings = 6;
// Steps, in widths of the box, at which a search by gradients is so near a minimum that Newton's
// method takes over.
constexpr double kNear = 1e-3;
// Least curvature of a step where the Hessian is not positive definite, as a fraction of the
// largest.
constexpr double kMinCurvature = 1e-10;
constexpr double kSufficient = 1e-4;     // of the predicted decrease: Armijo's condition
constexpr double kConvergedStep = 1e-9;  // in widths of the box
constexpr double kReached = 1e-12;       // room to a limit, relative to it, that is rounding only
// A decrease that the rounding of the cost hides is not tested any more.
constexpr double kRounding = 1e-12;

// The sides of a search's box and its constraints, as columns a of `normals` with aᵀη ≤ bound.
struct Limits {
  explicit Limits(const MinimizationProblem& problem) {
    const Eigen::Index n = problem.lower.size();
    normals.resize(n, 2 * n + problem.bound.size());
    normals << Matrix::Identity(n, n), -Matrix::Identity(n, n), problem.constraint.transpose();
    bounds.resize(normals.cols());
    bounds << problem.upper, -problem.lower, problem.bound;
  }

  // Whether the point is within all limits, but for rounding.
  bool Allow(const Vector& eta) const {
    const Eigen::ArrayXd rounding = kReached * (1 + bounds.array().abs());
    return ((normals.transpose() * eta - bounds).array() <= rounding).all();
  }

  Matrix normals;
  Vector bounds;
};

// Where a search takes steps: only where the cost is convex in the free directions, or anywhere.
enum class Steps { kWhereConvex, kAnywhere };

// Newton's method with an active set: steps keep to the limits that have stopped one before, until
// the cost falls away from such a limit (J. Nocedal, S. Wright, Numerical Optimization, 16.5).
class NewtonSearch {
 public:
  NewtonSearch(const Cost& cost, const MinimizationProblem& problem, Steps steps)
      : cost_(cost),
        lower_(problem.lower),
        upper_(problem.upper),
        limits_(problem),
        same_(kConvergedStep * (problem.upper - problem.lower)),
        steps_(steps) {}

  std::optional<Vector> From(Vector eta) {
    if (!limits_.Allow(eta)) return std::nullopt;
    const Eigen::Index max_steps = kMaxSteps + 2 * eta.size();
    Vector gradient(eta.size());
    for (Eigen::Index step = 0; step < max_steps; ++step) {
      const double value = cost_.EvaluateWithGradient(eta, gradient).total;
      if (!std::isfinite(value) || !gradient.allFinite()) return std::nullopt;
      if (step == 0) KeepTo(eta, gradient);
      const std::optional<Vector> move = Move(eta, gradient);
      if (!move) return std::nullopt;
      const double slope = gradient.dot(*move);
      if ((move->array().abs() <= same_.array()).all() || -slope <= kRounding * std::abs(value)) {
        if (!convex_) return std::nullopt;  // a saddle
        // Along a flat direction the last step may be long.
        Vector next = eta + *move;
        PutOnSides(next);
        const double most = value + kRounding * std::abs(value);
        if (limits_.Allow(next) && cost_.Evaluate(next).total <= most) eta = next;
        if (multipliers_.size() == 0 || multipliers_.minCoeff() >= 0) return eta;
        Eigen::Index falling;
        multipliers_.minCoeff(&falling);
        active_.erase(active_.begin() + falling);
      } else if (!Step(value, slope, *move, eta)) {
        return std::nullopt;
      }
    }
    return std::nullopt;
  }

 private:
  // Makes those limits active that the start has reached and beyond which the cost falls: without
  // them the Hessian need not be positive definite at a minimum.
  void KeepTo(Vector& eta, const Vector& gradient) {
    const Vector room = limits_.bounds - limits_.normals.transpose() * eta;
    const Vector slope = limits_.normals.transpose() * gradient;
    for (Eigen::Index i = 0; i < room.size(); ++i) {
      if (room[i] <= kReached * (1 + std::abs(limits_.bounds[i])) && slope[i] < 0) {
        active_.push_back(i);
      }
    }
    PutOnSides(eta);
  }

  // Makes a point that rounding has moved off the active sides of the box lie on them exactly, and
  // one that it has moved beyond the others, on those.
  void PutOnSides(Vector& eta) const {
    const Eigen::Index n = eta.size();
    for (const Eigen::Index i : active_) {
      if (i < 2 * n) eta[i % n] = i < n ? limits_.bounds[i] : -limits_.bounds[i];
    }
    eta = eta.cwiseMax(lower_).cwiseMin(upper_);
  }

  // Returns Newton's step in the directions that the active limits leave, and sets their
  // multipliers, those λ for which gradient + Σ λ a is least. Returns nothing where the Hessian
  // is not finite, or not positive definite where `steps_` asks for that.
  std::optional<Vector> Move(const Vector& eta, const Vector& gradient) {
    const Matrix hessian = cost_.Hessian(eta);
    if (!hessian.allFinite()) return std::nullopt;
    multipliers_.resize(0);
    if (active_.empty()) return NewtonStep(hessian, gradient);
    const PivotedQr factors = SolveByPivotedQr(limits_.normals(Eigen::all, active_), -gradient);
    multipliers_ = factors.solution;
    const Matrix free = factors.q.rightCols(eta.size() - factors.rank);
    convex_ = true;
    if (free.cols() == 0) return Vector(Vector::Zero(eta.size()));
    const std::optional<Vector> step =
        NewtonStep(free.transpose() * hessian * free, free.transpose() * gradient);
    return step ? std::optional<Vector>(free * *step) : std::nullopt;
  }

  // Where the Hessian is not positive definite, returns the step for the magnitudes of its
  // eigenvalues (ibid. 3.4), which leads down, away from a saddle.
  std::optional<Vector> NewtonStep(const Matrix& hessian, const Vector& gradient) {
    const CholeskyFactor factor(hessian);
    convex_ = factor.positive_definite();
    if (convex_) return FiniteStep(-factor.Solve(gradient));
    if (steps_ == Steps::kWhereConvex) return std::nullopt;
    const SymmetricEigen eigen = DecomposeSymmetric(hessian);
    const Vector size = eigen.values.cwiseAbs();
    const Vector curvature = size.cwiseMax(kMinCurvature * size.maxCoeff());
    return FiniteStep(-eigen.vectors *
                      (eigen.vectors.transpose() * gradient).cwiseQuotient(curvature));
  }

  static std::optional<Vector> FiniteStep(const Vector& step) {
    return step.allFinite() ? std::optional<Vector>(step) : std::nullopt;
  }

  // Goes along `move` up to a limit, which becomes active, or by as much as the cost falls
  // sufficiently; returns false where it does not.
  bool Step(double value, double slope, const Vector& move, Vector& eta) {
    const Vector room = limits_.bounds - limits_.normals.transpose() * eta;
    const Vector speed = limits_.normals.transpose() * move;
    double fraction = 1;
    std::optional<Eigen::Index> limit;
    for (Eigen::Index i = 0; i < room.size(); ++i) {
      if (std::ranges::find(active_, i) != active_.end()) continue;
      if (speed[i] <= 0 || room[i] >= fraction * speed[i]) continue;
      fraction = std::max(0.0, room[i] / speed[i]);
      limit = i;
    }
    const double most = value + kRounding * std::abs(value);
    for (int halving = 0; halving <= kMaxHalvings; ++halving, fraction /= 2) {
      const Vector next = eta + fraction * move;
      if (cost_.Evaluate(next).total <= most + kSufficient * fraction * slope) {
        eta = next;
        if (limit && halving == 0) active_.push_back(*limit);
        PutOnSides(eta);
        return true;
      }
    }
    return false;
  }

  const Cost& cost_;
  const Vector& lower_;
  const Vector& upper_;
  const Limits limits_;
  const Vector same_;
  std::vector<Eigen::Index> active_;
  const Steps steps_;
  Vector multipliers_;  // of the active limits
  bool convex_ = true;  // whether the Hessian of the last step was positive definite
};

}  // namespace

std::optional<Vector> MinimumByNewton(const Cost& cost, const MinimizationProblem& problem,
                                      const Vector& start) {
  return NewtonSearch(cost, problem, Steps::kWhereConvex).From(start);
}

std::vector<Minimum> FindMinimaOf(const Cost& cost, const MinimizationProblem& problem,
                                  const Matrix& starts, const Stop& stop) {
  const MinimizerOptions options;
  std::vector<Minimum> found;
  Matrix others(starts.rows(), starts.cols());
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < starts.rows(); ++i) {
    if (!stop.Check().ok() && i > 0) break;
    Vector start = starts.row(i).transpose();
    std::optional<Vector> reached = MinimumByNewton(cost, problem, start);
    if (!reached) {
      start = DescendFrom(problem, start, {.relative_step = kNear}, stop);
      reached = NewtonSearch(cost, problem, Steps::kAnywhere).From(start);
    }
    if (reached) {
      found.push_back({.point = *reached,
                       .value = problem.function(*reached, nullptr),
                       .converged = true,
                       .reason = "converged"});
    } else {
      others.row(count++) = start.transpose();
    }
  }
  if (count > 0) {
    for (Minimum& minimum : FindMinima(problem, others.topRows(count), options, stop)) {
      found.push_back(std::move(minimum));
    }
  }
  return DistinctMinima(std::move(found), problem, options);
}

}  // namespace polyest::internal
