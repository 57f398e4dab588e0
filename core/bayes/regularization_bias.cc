#include "core/bayes/regularization_bias.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/minimizer.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

constexpr double kAtBound = 1e-6;  // distance up to which a point counts as at the bound
// The distance from the prior's mean and from ξ̂ within which a germ without bounds is searched, in
// prior standard deviations.
constexpr double kReach = 20;

double Width(const Prior& prior, int i) {
  const double width = prior.upper()[i] - prior.lower()[i];
  return std::isfinite(width) ? width : 1;
}

// Returns Ω, cut off where it has no bound.
void SearchBox(const Prior& prior, const Vector& xi, MinimizationProblem& search) {
  const Vector deviation = prior.GermStandardDeviation();
  const int n = prior.dimension();
  search.lower.resize(n);
  search.upper.resize(n);
  search.constraint.resize(0, n);
  search.bound.resize(0);
  for (int i = 0; i < n; ++i) {
    const double mean = prior.germs()[static_cast<size_t>(i)].Mean();
    const double reach = kReach * deviation[i], off = prior.OffBound(i);
    search.lower[i] = std::max(std::min(mean, xi[i]) - reach, prior.lower()[i] + off);
    search.upper[i] = std::min(std::max(mean, xi[i]) + reach, prior.upper()[i] - off);
  }
}

// Returns H_mismatch with respect to the germ, without its negative curvatures (in units of the
// prior's).
Matrix ConvexMismatchHessian(const Cost& cost, const ConstVectorRef& eta) {
  const Vector deviation = cost.prior().GermStandardDeviation();
  const Matrix unscale = Inverse(cost.region().axes()) * deviation.asDiagonal();
  const Matrix scaled = unscale.transpose() * cost.MismatchHessian(eta) * unscale;
  if (!scaled.allFinite()) return Matrix::Zero(deviation.size(), deviation.size());
  const SymmetricEigen eigen = DecomposeSymmetric(scaled);
  const Matrix root = deviation.cwiseInverse().asDiagonal() * eigen.vectors *
                      eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
  return root * root.transpose();
}

}  // namespace

Vector RegularizationBias(const Cost& cost, const ConstVectorRef& eta, const Stop& stop) {
  const Prior& prior = cost.prior();
  if (cost.regularization() == 1) return Vector::Zero(prior.dimension());
  MinimizationProblem search;
  SearchBox(prior, cost.region().ToGerm(eta), search);
  const Vector xi = cost.region().ToGerm(eta).cwiseMax(search.lower).cwiseMin(search.upper);
  const Matrix hessian = ConvexMismatchHessian(cost, eta);
  Vector gradient(eta.size());
  cost.EvaluateWithGradient(eta, gradient);
  const Vector of_total = SolveTransposed(cost.region().axes(), gradient);
  Vector g = -cost.regularization() * prior.Gradient(xi);
  for (int i = 0; i < prior.dimension(); ++i) {
    const double near = kAtBound * Width(prior, i);
    if (xi[i] - prior.lower()[i] < near || prior.upper()[i] - xi[i] < near) g[i] += of_total[i];
  }
  search.function = [&](const Vector& at, Vector* slope) {
    const Vector step = at - xi;
    const Vector pull = hessian * step;
    if (slope != nullptr) *slope = g + pull + prior.Gradient(at);
    return g.dot(step) + 0.5 * step.dot(pull) + prior.NegativeLogDensity(at);
  };
  const Minimum bayes = FindMinima(search, xi.transpose(), MinimizerOptions(), stop).front();
  return prior.ToParameters(xi) - prior.ToParameters(bayes.point);
}

}  // namespace polyest::internal
