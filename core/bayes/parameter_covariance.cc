#include "core/bayes/parameter_covariance.h"

#include <algorithm>
#include <cmath>

#include "core/chaos/gauss_rule.h"

namespace polyest::internal {
namespace {

constexpr int kTerms = 40;  // (3.03²)^40/40! of the widest lognormal is 10⁻⁹
constexpr int kNodes = 64;
// The widest spread of a logarithm, far beyond that of any lognormal prior. A log-uniform one of a
// hundred powers of ten may have more, and e to the square of it would not be a number.
constexpr double kWidestLogarithm = 6;

// The polynomials h_1 … h_kTerms at the nodes, √(k+1) h_{k+1} = u h_k − √k h_{k−1}, times the
// weights: kTerms × kNodes.
struct HermiteRule {
  Vector nodes;
  Matrix weighted;
};

HermiteRule MakeHermiteRule() {
  const GaussRule rule = MakeGaussRule(Germ::Normal(), kNodes);
  Matrix values(kTerms + 1, kNodes);
  values.row(0).setOnes();
  values.row(1) = rule.nodes.transpose();
  for (int k = 1; k < kTerms; ++k) {
    values.row(k + 1) =
        (rule.nodes.transpose().cwiseProduct(values.row(k)) - std::sqrt(k) * values.row(k - 1)) /
        std::sqrt(k + 1);
  }
  return {rule.nodes, values.bottomRows(kTerms) * rule.weights.asDiagonal()};
}

// Returns c_1 … c_kTerms of parameter i at score z with standard deviation s.
Vector Coefficients(const Prior& prior, int i, double z, double s) {
  const UncertainParameter& parameter = prior.parameters()[static_cast<size_t>(i)];
  Vector coefficients = Vector::Zero(kTerms);
  if (prior.germs()[static_cast<size_t>(i)] != Germ(parameter.germ)) {
    static const HermiteRule rule = MakeHermiteRule();
    Vector values(kNodes);
    for (int q = 0; q < kNodes; ++q) values[q] = prior.OfScore(i, z + s * rule.nodes[q]);
    return rule.weighted * values;
  }
  const double spread = parameter.scale * s;
  if (parameter.map == ParameterMap::kAffine) {
    coefficients[0] = spread;
    return coefficients;
  }
  const double bounded = std::min(spread, kWidestLogarithm);
  double coefficient = parameter.ToParameter(z) * std::exp(0.5 * bounded * bounded);
  for (int k = 1; k <= kTerms; ++k) {
    coefficient *= bounded / std::sqrt(k);
    coefficients[k - 1] = coefficient;
  }
  return coefficients;
}

}  // namespace

Matrix ParameterCovariance(const Prior& prior, const ConstVectorRef& z,
                           const ConstMatrixRef& root) {
  const Eigen::Index n = root.rows();
  Matrix coefficients(kTerms, n);
  Matrix units = Matrix::Zero(n, root.cols());
  for (Eigen::Index i = 0; i < n; ++i) {
    const double s = root.row(i).norm();
    coefficients.col(i) = Coefficients(prior, static_cast<int>(i), z[i], s);
    if (s > 0) units.row(i) = root.row(i) / s;
  }
  const Matrix correlation = units * units.transpose();
  Matrix power = Matrix::Ones(n, n);
  Matrix covariance = Matrix::Zero(n, n);
  for (Eigen::Index k = 0; k < kTerms; ++k) {
    power = power.cwiseProduct(correlation);
    covariance += power.cwiseProduct(coefficients.row(k).transpose() * coefficients.row(k));
  }
  return covariance;
}

Matrix PriorCovariance(const Prior& prior) {
  const Vector deviation = prior.StandardDeviation();
  if (!prior.correlated()) return deviation.cwiseAbs2().asDiagonal();
  const Matrix root = prior.factor() * prior.GermStandardDeviation().asDiagonal();
  const Matrix covariance = ParameterCovariance(prior, Vector::Zero(prior.dimension()), root);
  const Vector factor = deviation.cwiseQuotient(covariance.diagonal().cwiseSqrt());
  return factor.asDiagonal() * covariance * factor.asDiagonal();
}

}  // namespace polyest::internal
