#include "core/estimator/expansion/run_marginal.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/chaos/gauss_rule.h"
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
constexpr Eigen::Index kMostInBox = 3;

// Returns the Hessian, raised until it is positive definite.
Matrix PositiveDefinite(const Matrix& hessian) {
  const Eigen::Index n = hessian.rows();
  const double size = std::max(hessian.cwiseAbs().maxCoeff(), 1e-12);
  Matrix raised = hessian;
  for (double shift = 1e-8 * size; !CholeskyFactor(raised).positive_definite(); shift *= 10) {
    raised = hessian + shift * Matrix::Identity(n, n);
  }
  return raised;
}

// Returns −log ∫ of values with weights.
double NegativeLogSum(const Vector& costs, const Vector& weights) {
  const double least = costs.minCoeff();
  if (!std::isfinite(least)) return kInfinity;
  return least - std::log(weights.dot((least - costs.array()).exp().matrix()));
}

}  // namespace

RunMarginal::RunMarginal(const Cost& cost, int shared, std::vector<int> own)
    : cost_(cost), shared_(shared), own_(std::move(own)) {}

Vector RunMarginal::Joined(const ConstVectorRef& eta_shared, const ConstVectorRef& eta_own) const {
  Vector eta(eta_shared.size() + eta_own.size());
  eta << eta_shared, eta_own;
  return eta;
}

ConditionalMinimum RunMarginal::Minimize(const ConstVectorRef& eta_shared,
                                         const Vector& start) const {
  const Eigen::Index own = start.size();
  Vector gradient(shared_ + own);
  ConditionalMinimum minimum;
  minimum.own = start;
  for (int i = 0; i < kMaxSteps; ++i) {
    const Vector eta = Joined(eta_shared, minimum.own);
    minimum.value = cost_.EvaluateWithGradient(eta, gradient).total;
    minimum.hessian = PositiveDefinite(cost_.Hessian(eta).bottomRightCorner(own, own));
    Vector step = -CholeskyFactor(minimum.hessian).Solve(gradient.tail(own));
    if (!step.allFinite() || !(step.norm() > kShortestStep)) break;
    if (step.norm() > kLongestStep) step *= kLongestStep / step.norm();
    int halvings = 0;
    for (; halvings < kMaxHalvings; ++halvings, step /= 2) {
      const double value = cost_.Evaluate(Joined(eta_shared, minimum.own + step)).total;
      if (value < minimum.value || !std::isfinite(minimum.value)) break;
    }
    if (halvings == kMaxHalvings) break;
    minimum.own += step;
  }
  return minimum;
}

double RunMarginal::NegativeLogIntegral(const ConstVectorRef& eta_shared,
                                        const ConditionalMinimum& minimum) const {
  const Eigen::Index own = minimum.own.size();
  if (own == 1) return IntegrateLine(eta_shared, minimum);
  if (own <= kMostInBox) return IntegrateBox(eta_shared, minimum);
  return minimum.value + CholeskyFactor(minimum.hessian).HalfLogDeterminant() -
         0.5 * static_cast<double>(own) * std::log(2 * std::numbers::pi);
}

double RunMarginal::IntegrateLine(const ConstVectorRef& eta_shared,
                                  const ConditionalMinimum& minimum) const {
  const double reach = kLineReach / std::sqrt(minimum.hessian(0, 0));
  const auto own = static_cast<Eigen::Index>(own_.front());
  // ξ_own = base + slope η_φ
  const Region& region = cost_.region();
  const double slope = region.axes()(own, shared_);
  const double base = region.ToGerm(Joined(eta_shared, Vector::Zero(1)))[own];
  const double to_lower = (cost_.prior().lower()[own] - base) / slope;
  const double to_upper = (cost_.prior().upper()[own] - base) / slope;
  const double lower = std::max(minimum.own[0] - reach, std::min(to_lower, to_upper));
  const double upper = std::min(minimum.own[0] + reach, std::max(to_lower, to_upper));
  if (!(upper > lower)) return kInfinity;
  static const GaussRule& rule = *new GaussRule(MakeGaussRule(Germ::Uniform(), kLineNodes));
  Matrix etas(kLineNodes, shared_ + 1);
  etas.leftCols(shared_) = eta_shared.transpose().replicate(kLineNodes, 1);
  etas.col(shared_) = 0.5 * (lower + upper) + (0.5 * (upper - lower) * rule.nodes).array();
  Vector costs;
  cost_.EvaluateMany(etas, costs);
  return NegativeLogSum(costs, (upper - lower) * rule.weights);
}

double RunMarginal::IntegrateBox(const ConstVectorRef& eta_shared,
                                 const ConditionalMinimum& minimum) const {
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
  Matrix etas(count, shared_ + own);
  etas.leftCols(shared_) = eta_shared.transpose().replicate(count, 1);
  etas.rightCols(own) =
      SolveLowerTransposedRows(factor.Lower(), deviates).rowwise() + minimum.own.transpose();
  Vector costs;
  cost_.EvaluateMany(etas, costs);
  costs -= 0.5 * deviates.rowwise().squaredNorm();
  return NegativeLogSum(costs, weights) + factor.HalfLogDeterminant() -
         0.5 * static_cast<double>(own) * std::log(2 * std::numbers::pi);
}

}  // namespace polyest::internal
