#include "core/chaos/germ.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/SpecialFunctions>

#include "core/chaos/beta_gamma.h"
#include "core/chaos/exponential.h"
#include "core/chaos/normal.h"
#include "core/chaos/truncated_normal.h"
#include "core/common/check.h"

namespace polyest::internal {

Germ::Germ(GermFamily family, double first_shape, double second_shape)
    : family_(family), first_shape_(first_shape), second_shape_(second_shape) {
  switch (family_) {
    case GermFamily::kNormal:  // 1/√(2π)
      log_normalization_ = -0.5 * kLogTwoPi;
      break;
    case GermFamily::kUniform:  // 1/2
      log_normalization_ = -std::numbers::ln2;
      break;
    case GermFamily::kBeta:  // 1 / (2^(α+β−1) B(α, β))
      log_normalization_ = -(first_shape_ + second_shape_ - 1) * std::numbers::ln2 -
                           LogBeta(first_shape_, second_shape_);
      break;
    case GermFamily::kGamma:  // 1 / Γ(shape)
      log_normalization_ = -LogGamma(first_shape_);
      break;
    case GermFamily::kTruncatedNormal:  // 1/(√(2π) ∫_a^b φ)
      probability_ = NormalProbability(first_shape_, second_shape_);
      log_normalization_ = -0.5 * kLogTwoPi - std::log(probability_);
      TakeMoments();
      break;
    case GermFamily::kExponential:
      log_normalization_ = LogExponentialNormalization(first_shape_);
      TakeMoments();
      break;
  }
}

void Germ::TakeMoments() {
  // a_0 is the mean, b_1 the variance.
  const RecurrenceCoefficients moments = Recurrence(2);
  mean_ = moments.a[0];
  standard_deviation_ = std::sqrt(moments.b[1]);
}

Germ::Germ(const GermShape& shape) : Germ(shape.family, shape.first, shape.second) {}

Germ Germ::Normal() { return Germ(GermFamily::kNormal, 0, 0); }

Germ Germ::Uniform() { return Germ(GermFamily::kUniform, 0, 0); }

Germ Germ::Beta(double alpha, double beta) {
  POLYEST_CHECK(alpha >= 1 && beta >= 1 && std::isfinite(alpha + beta));
  return Germ(GermFamily::kBeta, alpha, beta);
}

Germ Germ::Gamma(double shape) {
  POLYEST_CHECK(shape >= 1 && std::isfinite(shape));
  return Germ(GermFamily::kGamma, shape, 0);
}

Germ Germ::TruncatedNormal(double lower, double upper) {
  POLYEST_CHECK(lower < upper && NormalProbability(lower, upper) >= kMinTruncatedProbability);
  return Germ(GermFamily::kTruncatedNormal, lower, upper);
}

Germ Germ::Exponential(double rate) {
  POLYEST_CHECK(rate > 0 && rate <= kMaxRate);
  return Germ(GermFamily::kExponential, rate, 0);
}

double Germ::Lower() const {
  switch (family_) {
    case GermFamily::kNormal:
      return -kInfinity;
    case GermFamily::kUniform:
    case GermFamily::kBeta:
    case GermFamily::kExponential:
      return -1;
    case GermFamily::kGamma:
      return 0;
    case GermFamily::kTruncatedNormal:
      return first_shape_;
  }
  return 0;
}

double Germ::Upper() const {
  if (family_ == GermFamily::kTruncatedNormal) return second_shape_;
  return family_ == GermFamily::kNormal || family_ == GermFamily::kGamma ? kInfinity : 1;
}

double Germ::Mean() const {
  const double alpha = first_shape_, beta = second_shape_;
  switch (family_) {
    case GermFamily::kNormal:
    case GermFamily::kUniform:
      return 0;
    case GermFamily::kBeta:  // (α − β) / (α + β)
      return (alpha - beta) / (alpha + beta);
    case GermFamily::kGamma:
      return first_shape_;
    case GermFamily::kTruncatedNormal:
    case GermFamily::kExponential:
      return mean_;
  }
  return 0;
}

double Germ::StandardDeviation() const {
  const double alpha = first_shape_, beta = second_shape_, sum = alpha + beta;
  switch (family_) {
    case GermFamily::kNormal:
      return 1;
    case GermFamily::kUniform:
      return 1 / std::numbers::sqrt3;
    case GermFamily::kBeta:  // 2 √(αβ / (α + β + 1)) / (α + β)
      return 2 * std::sqrt(alpha * beta / (sum + 1)) / sum;
    case GermFamily::kGamma:
      return std::sqrt(first_shape_);
    case GermFamily::kTruncatedNormal:
    case GermFamily::kExponential:
      return standard_deviation_;
  }
  return 0;
}

double Germ::Mode() const {
  const double alpha = first_shape_, beta = second_shape_;
  switch (family_) {
    case GermFamily::kNormal:
    case GermFamily::kUniform:
      return 0;
    case GermFamily::kBeta:  // (α − β) / (α + β − 2); Beta(1, 1) is the uniform density
      return alpha + beta > 2 ? (alpha - beta) / (alpha + beta - 2) : 0;
    case GermFamily::kGamma:
      return first_shape_ - 1;
    case GermFamily::kTruncatedNormal:
      return std::clamp(0.0, first_shape_, second_shape_);
    case GermFamily::kExponential:
      return 1;
  }
  return 0;
}

double Germ::Density(double xi) const { return std::exp(LogDensity(xi)); }

double Germ::LogDensity(double xi) const {
  if (!(xi >= Lower() && xi <= Upper())) return -kInfinity;
  switch (family_) {
    case GermFamily::kNormal:
    case GermFamily::kTruncatedNormal:
      return log_normalization_ - 0.5 * xi * xi;
    case GermFamily::kUniform:
      return log_normalization_;
    case GermFamily::kBeta:
      return log_normalization_ + TimesLog(first_shape_ - 1, 1 + xi) +
             TimesLog(second_shape_ - 1, 1 - xi);
    case GermFamily::kGamma:
      if (std::isinf(xi)) return -kInfinity;
      return log_normalization_ + TimesLog(first_shape_ - 1, xi) - xi;
    case GermFamily::kExponential:
      return log_normalization_ + first_shape_ * xi;
  }
  return -kInfinity;
}

void Germ::SubtractLogDensities(const ConstVectorRef& xis, VectorRef values) const {
  if (family_ == GermFamily::kNormal) {
    values.array() -= log_normalization_ - 0.5 * xis.array().square();
  } else {
    for (Eigen::Index i = 0; i < xis.size(); ++i) values[i] -= LogDensity(xis[i]);
  }
}

double Germ::LogDensityDerivative(double xi) const {
  switch (family_) {
    case GermFamily::kNormal:
    case GermFamily::kTruncatedNormal:
      return -xi;
    case GermFamily::kUniform:
      return 0;
    case GermFamily::kBeta:  // (α − 1)/(1 + ξ) − (β − 1)/(1 − ξ)
      return (first_shape_ - 1) / (1 + xi) - (second_shape_ - 1) / (1 - xi);
    case GermFamily::kGamma:  // (shape − 1)/ξ − 1
      return (first_shape_ - 1) / xi - 1;
    case GermFamily::kExponential:
      return first_shape_;
  }
  return 0;
}

double Germ::LogDensitySecondDerivative(double xi) const {
  switch (family_) {
    case GermFamily::kNormal:
    case GermFamily::kTruncatedNormal:
      return -1;
    case GermFamily::kUniform:
    case GermFamily::kExponential:
      return 0;
    case GermFamily::kBeta:  // −(α − 1)/(1 + ξ)² − (β − 1)/(1 − ξ)²
      return -(first_shape_ - 1) / ((1 + xi) * (1 + xi)) -
             (second_shape_ - 1) / ((1 - xi) * (1 - xi));
    case GermFamily::kGamma:  // −(shape − 1)/ξ²
      return -(first_shape_ - 1) / (xi * xi);
  }
  return 0;
}

double Germ::CumulativeProbability(double xi) const {
  switch (family_) {
    case GermFamily::kNormal:
      return NormalCdf(xi);
    case GermFamily::kUniform:
      return std::clamp(0.5 * (1 + xi), 0.0, 1.0);
    case GermFamily::kBeta:
      return IncompleteBeta(first_shape_, second_shape_, 0.5 * (1 + xi));
    case GermFamily::kGamma:
      return LowerIncompleteGamma(first_shape_, xi);
    case GermFamily::kTruncatedNormal:
      return NormalProbability(first_shape_, std::min(xi, second_shape_)) / probability_;
    case GermFamily::kExponential:
      return ExponentialProbability(first_shape_, xi);
  }
  return 0;
}

double Germ::UpperProbability(double xi) const {
  switch (family_) {
    case GermFamily::kNormal:
      return NormalCdf(-xi);
    case GermFamily::kUniform:
      return std::clamp(0.5 * (1 - xi), 0.0, 1.0);
    case GermFamily::kBeta:  // the mirrored density
      return IncompleteBeta(second_shape_, first_shape_, 0.5 * (1 - xi));
    case GermFamily::kGamma:
      return UpperIncompleteGamma(first_shape_, xi);
    case GermFamily::kTruncatedNormal:
      return NormalProbability(std::max(xi, first_shape_), second_shape_) / probability_;
    case GermFamily::kExponential:
      return UpperExponentialProbability(first_shape_, xi);
  }
  return 0;
}

double Germ::LowerQuantile(double probability) const {
  switch (family_) {
    case GermFamily::kNormal:
      return Eigen::numext::ndtri(probability);
    case GermFamily::kUniform:
      return 2 * probability - 1;
    case GermFamily::kBeta:
      return 2 * LowerBetaQuantile(first_shape_, second_shape_, probability) - 1;
    case GermFamily::kGamma:
      return LowerGammaQuantile(first_shape_, probability);
    case GermFamily::kTruncatedNormal:
      return TruncatedNormalQuantile(first_shape_, second_shape_, probability);
    case GermFamily::kExponential:
      return ExponentialQuantile(first_shape_, probability);
  }
  return 0;
}

double Germ::UpperQuantile(double probability) const {
  switch (family_) {
    case GermFamily::kNormal:
      return -Eigen::numext::ndtri(probability);
    case GermFamily::kUniform:
      return 1 - 2 * probability;
    case GermFamily::kBeta:  // the upper tail is the lower one of the mirrored density
      return 1 - 2 * LowerBetaQuantile(second_shape_, first_shape_, probability);
    case GermFamily::kGamma:
      return UpperGammaQuantile(first_shape_, probability);
    case GermFamily::kTruncatedNormal:
      return -TruncatedNormalQuantile(-second_shape_, -first_shape_, probability);
    case GermFamily::kExponential:
      return UpperExponentialQuantile(first_shape_, probability);
  }
  return 0;
}

double Germ::Quantile(double probability) const {
  POLYEST_CHECK(probability > 0 && probability < 1);
  // The nearer tail is inverted: 1 − p is exact for p ≥ ½.
  return probability <= 0.5 ? LowerQuantile(probability) : UpperQuantile(1 - probability);
}

double Germ::OfNormalScore(double score) const {
  if (family_ == GermFamily::kNormal || std::isnan(score)) return score;
  const double tail = NormalCdf(-std::min(std::abs(score), kMaxScore));
  return score <= 0 ? LowerQuantile(tail) : UpperQuantile(tail);
}

double Germ::NormalScore(double xi) const {
  if (family_ == GermFamily::kNormal) return xi;
  const double lower = CumulativeProbability(xi);
  const double tail = lower <= 0.5 ? lower : UpperProbability(xi);
  const double score = tail > 0 ? Eigen::numext::ndtri(tail) : -kInfinity;
  return lower <= 0.5 ? score : -score;
}

namespace {

// Hermite for the weight e^(−ξ²/2): a_k = 0, b_k = k.
RecurrenceCoefficients HermiteRecurrence(int count) {
  RecurrenceCoefficients result{Vector::Zero(count), Vector::Ones(count)};
  for (int k = 1; k < count; ++k) result.b[k] = k;
  return result;
}

// Legendre for a constant weight: a_k = 0, b_k = k²/(4k² − 1).
RecurrenceCoefficients LegendreRecurrence(int count) {
  RecurrenceCoefficients result{Vector::Zero(count), Vector::Ones(count)};
  for (int k = 1; k < count; ++k) {
    const double square = static_cast<double>(k) * k;
    result.b[k] = square / (4 * square - 1);
  }
  return result;
}

// Laguerre for the weight ξ^(α−1) e^(−ξ): a_k = 2k + α, b_k = k (k + α − 1).
RecurrenceCoefficients LaguerreRecurrence(double alpha, int count) {
  RecurrenceCoefficients result{Vector::Zero(count), Vector::Ones(count)};
  for (int k = 0; k < count; ++k) {
    result.a[k] = 2.0 * k + alpha;
    if (k > 0) result.b[k] = k * (k + alpha - 1);
  }
  return result;
}

// Jacobi for the weight (1 − ξ)^A (1 + ξ)^B, A = β − 1, B = α − 1:
//   a_k = (B² − A²) / ((2k+A+B)(2k+A+B+2)),
//   b_k = 4k(k+A)(k+B)(k+A+B) / ((2k+A+B)² (2k+A+B+1)(2k+A+B−1)).
RecurrenceCoefficients JacobiRecurrence(double alpha, double beta, int count) {
  RecurrenceCoefficients result{Vector::Zero(count), Vector::Ones(count)};
  const double a = beta - 1, b = alpha - 1;
  for (Eigen::Index i = 0; i < result.a.size(); ++i) {
    const double k = static_cast<double>(i);
    const double c = 2 * k + a + b;
    // The factor A + B of a_0 cancels, which matters when it is zero.
    result.a[i] = i == 0 ? (b - a) / (c + 2) : (b - a) * (a + b) / (c * (c + 2));
    if (i > 0) {
      result.b[i] = 4 * k * (k + a) * (k + b) * (k + a + b) / (c * c * (c + 1) * (c - 1));
    }
  }
  return result;
}

}  // namespace

RecurrenceCoefficients Germ::Recurrence(int count) const {
  POLYEST_CHECK(count >= 1);
  switch (family_) {
    case GermFamily::kNormal:
      return HermiteRecurrence(count);
    case GermFamily::kUniform:
      return LegendreRecurrence(count);
    case GermFamily::kBeta:
      return JacobiRecurrence(first_shape_, second_shape_, count);
    case GermFamily::kGamma:
      return LaguerreRecurrence(first_shape_, count);
    case GermFamily::kTruncatedNormal:
      return TruncatedNormalRecurrence(first_shape_, second_shape_, count);
    case GermFamily::kExponential:
      return ExponentialRecurrence(first_shape_, count);
  }
  return {};
}

}  // namespace polyest::internal
