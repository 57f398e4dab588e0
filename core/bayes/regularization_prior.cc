#include "core/bayes/regularization_prior.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/chaos/beta_gamma.h"
#include "core/chaos/exponential.h"
#include "core/chaos/normal.h"
#include "core/chaos/truncated_normal.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

// The distance beyond which Mills' ratio gives the probability, which may underflow.
constexpr double kTail = 30;

// Returns M(x) = ∫_x^∞ φ ÷ φ(x) = 1/(x + 1/(x + 2/(x + 3/(x + …)))), to rounding for x ≥ kTail.
double MillsRatio(double x) {
  if (std::isinf(x)) return 0;
  double denominator = x;
  for (int k = 12; k >= 1; --k) denominator = x + k / denominator;
  return 1 / denominator;
}

// Returns log ∫_a^b φ, even if the integral itself underflows.
double LogNormalProbability(double a, double b) {
  if (b <= -kTail) return LogNormalProbability(-b, -a);
  if (a < kTail) return std::log(NormalProbability(a, b));
  // φ(a) (M(a) − e^{−(b² − a²)/2} M(b))
  const double beyond = std::isinf(b) ? 0 : std::exp(-0.5 * (b - a) * (b + a)) * MillsRatio(b);
  return -0.5 * (a * a + kLogTwoPi) + std::log(MillsRatio(a) - beyond);
}

// Returns −log of the constant factor of the beta density on [−1, 1]: log (2^{a+b−1} B(a, b)).
double LogBetaIntegral(double a, double b) {
  return (a + b - 1) * std::numbers::ln2 + LogBeta(a, b);
}

}  // namespace

double LogNormalization(const Germ& germ, double regularization) {
  POLYEST_CHECK(regularization > 0);
  const double r = regularization, a = germ.first_shape(), b = germ.second_shape();
  switch (germ.family()) {
    case GermFamily::kNormal:
      return 0.5 * ((1 - r) * kLogTwoPi - std::log(r));
    case GermFamily::kUniform:
      return (1 - r) * std::numbers::ln2;
    case GermFamily::kBeta:
      return LogBetaIntegral(1 + r * (a - 1), 1 + r * (b - 1)) - r * LogBetaIntegral(a, b);
    case GermFamily::kGamma: {
      const double shape = 1 + r * (a - 1);
      return LogGamma(shape) - shape * std::log(r) - r * LogGamma(a);
    }
    case GermFamily::kTruncatedNormal: {
      const double root = std::sqrt(r);
      return 0.5 * ((1 - r) * kLogTwoPi - std::log(r)) + LogNormalProbability(root * a, root * b) -
             r * LogNormalProbability(a, b);
    }
    case GermFamily::kExponential:
      return r * LogExponentialNormalization(a) - LogExponentialNormalization(r * a);
  }
  POLYEST_CHECK(false);
}

double WeightedVariance(const Germ& germ, double regularization) {
  POLYEST_CHECK(regularization > 0);
  const double r = regularization, a = germ.first_shape(), b = germ.second_shape();
  const double width = germ.Upper() - germ.Lower();
  switch (germ.family()) {
    case GermFamily::kNormal:
      return 1 / r;
    case GermFamily::kUniform:
      return 1.0 / 3;
    case GermFamily::kBeta: {
      const double deviation = Germ::Beta(1 + r * (a - 1), 1 + r * (b - 1)).StandardDeviation();
      return deviation * deviation;
    }
    case GermFamily::kGamma:  // s'/α⁴
      return (1 + r * (a - 1)) / (r * r);
    case GermFamily::kTruncatedNormal:
      return std::min(1 / r, width * width / 12);
    case GermFamily::kExponential:  // of the density ∝ e^{α² rate ξ}
      return std::min(1 / (r * r * a * a), width * width / 12);
  }
  POLYEST_CHECK(false);
}

double LogLaplaceNormalization(const Germ& germ, double regularization) {
  const double mode = germ.Mode();
  const double variance = WeightedVariance(germ, regularization);
  // The second derivative is 0/0 if the density ends in a corner that is its mode.
  const double second = germ.LogDensitySecondDerivative(mode);
  const double curvature = std::isfinite(second) ? -regularization * second : 0;
  // ρ(mode)^{α²} √(2π ÷ curvature)
  return regularization * germ.LogDensity(mode) +
         0.5 * (kLogTwoPi - std::log(std::max(curvature, 1 / variance)));
}

}  // namespace polyest::internal
