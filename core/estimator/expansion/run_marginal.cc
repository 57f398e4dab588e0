#include "core/estimator/expansion/run_marginal.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/chaos/gauss_rule.h"
#include "core/chaos/normal.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr int kMaxSteps = 50;
constexpr int kMaxHalvings = 30;
constexpr double kLongestStep = 1;  // half widths of the region
constexpr double kShortestStep = 1e-9;
constexpr double kLineReach = 7;  // standard deviations
constexpr int kLineNodes = 48;
constexpr int kBoxNodes = 7;  // for each of two or three parameters
constexpr Eigen::Index kMaxInBox = 3;

// Returns the Hessian, which must be finite, raised until it is positive definite.
Matrix PositiveDefinite(const Matrix& hessian) {
  const Eigen::Index n = hessian.rows();
  const double size = std::max(hessian.cwiseAbs().maxCoeff(), 1e-12);
  Matrix raised = hessian;
  for (double shift = 1e-8 * size; !CholeskyFactor(raised).positive_definite(); shift *= 10) {
    raised = hessian + shift * Matrix::Identity(n, n);
  }
  return raised;
}

// Returns what stands for a minimum where the cost has no Hessian.
ConditionalMinimum NoMinimum(const Vector& start) {
  ConditionalMinimum none;
  none.own = start;
  none.hessian.setIdentity(start.size(), start.size());
  none.value = kInfinity;
  return none;
}

// Returns −log ∫ of values with weights.
double NegativeLogSum(const Vector& costs, const Vector& weights) {
  const double least = costs.minCoeff();
  if (!std::isfinite(least)) return kInfinity;
  return least - std::log(weights.dot((least - costs.array()).exp().matrix()));
}

}  // namespace

RunMarginal::RunMarginal(const Cost& cost, Matrix directions)
    : cost_(cost), directions_(std::move(directions)) {}

ConditionalMinimum RunMarginal::Minimize(const Vector& origin, const Vector& start) const {
  Vector gradient(origin.size());
  ConditionalMinimum minimum;
  minimum.own = start;
  for (int steps = 0;; ++steps) {
    const Vector eta = origin + directions_ * minimum.own;
    minimum.value = cost_.EvaluateWithGradient(eta, gradient).total;
    const Matrix hessian = directions_.transpose() * cost_.Hessian(eta) * directions_;
    if (!hessian.allFinite()) return NoMinimum(start);
    minimum.hessian = PositiveDefinite(hessian);
    Vector step = -CholeskyFactor(minimum.hessian).Solve(directions_.transpose() * gradient);
    if (steps == kMaxSteps || !step.allFinite() || !(step.norm() > kShortestStep)) break;
    if (step.norm() > kLongestStep) step *= kLongestStep / step.norm();
    int halvings = 0;
    for (; halvings < kMaxHalvings; ++halvings, step /= 2) {
      const double value = cost_.Evaluate(eta + directions_ * step).total;
      if (value < minimum.value || !std::isfinite(minimum.value)) break;
    }
    if (halvings == kMaxHalvings) break;
    minimum.own += step;
  }
  return minimum;
}

double RunMarginal::NegativeLogIntegral(const Vector& origin,
                                        const ConditionalMinimum& minimum) const {
  const Eigen::Index own = minimum.own.size();
  if (own == 1) return IntegrateLine(origin, minimum);
  if (own <= kMaxInBox) return IntegrateBox(origin, minimum);
  return minimum.value + CholeskyFactor(minimum.hessian).HalfLogDeterminant() -
         0.5 * static_cast<double>(own) * kLogTwoPi;
}

double RunMarginal::IntegrateLine(const Vector& origin, const ConditionalMinimum& minimum) const {
  const double reach = kLineReach / std::sqrt(minimum.hessian(0, 0));
  double lower = minimum.own[0] - reach, upper = minimum.own[0] + reach;
  // ξ = base + slope η_φ
  const Region& region = cost_.region();
  const Vector slope = region.axes() * directions_;
  const Vector base = region.ToGerm(origin);
  for (Eigen::Index i = 0; i < slope.size(); ++i) {
    if (slope[i] == 0) continue;
    const double to_lower = (cost_.prior().lower()[i] - base[i]) / slope[i];
    const double to_upper = (cost_.prior().upper()[i] - base[i]) / slope[i];
    lower = std::max(lower, std::min(to_lower, to_upper));
    upper = std::min(upper, std::max(to_lower, to_upper));
  }
  if (!(upper > lower)) return kInfinity;
  static const GaussRule& rule = *new GaussRule(MakeGaussRule(Germ::Uniform(), kLineNodes));
  const Vector places = 0.5 * (lower + upper) + (0.5 * (upper - lower) * rule.nodes).array();
  Matrix etas = places * directions_.transpose();
  etas.rowwise() += origin.transpose();
  Vector costs;
  cost_.EvaluateMany(etas, costs);
  return NegativeLogSum(costs, (upper - lower) * rule.weights);
}

double RunMarginal::IntegrateBox(const Vector& origin, const ConditionalMinimum& minimum) const {
  static const GaussRule& rule = *new GaussRule(MakeGaussRule(Germ::Normal(), kBoxNodes));
  const Eigen::Index own = minimum.own.size();
  Eigen::Index count = 1;
  for (Eigen::Index j = 0; j < own; ++j) count *= kBoxNodes;
  Matrix deviates(count, own);
  Vector weights = Vector::Ones(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0, rest = i; j < own; ++j, rest /= kBoxNodes) {
      deviates(i, j) = rule.nodes[rest % kBoxNodes];
      weights[i] *= rule.weights[rest % kBoxNodes];
    }
  }
  const CholeskyFactor factor(minimum.hessian);
  const Matrix places =
      SolveLowerTransposedRows(factor.Lower(), deviates).rowwise() + minimum.own.transpose();
  Matrix etas = places * directions_.transpose();
  etas.rowwise() += origin.transpose();
  Vector costs;
  cost_.EvaluateMany(etas, costs);
  costs -= 0.5 * deviates.rowwise().squaredNorm();
  return NegativeLogSum(costs, weights) + factor.HalfLogDeterminant() -
         0.5 * static_cast<double>(own) * kLogTwoPi;
}

}  // namespace polyest::internal
