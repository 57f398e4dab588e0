#include "core/chaos/beta_gamma.h"

#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

namespace polyest::internal {
namespace {

struct ValueAndSlope {
  double value;
  double slope;
};

// Returns the root of an increasing function between lower and upper (which may be infinite) by
// Newton's method, safeguarded by bisection. The functions are logarithms of probabilities of
// log-concave densities, thus concave or convex: Newton's steps then come from one side only and
// converge quadratically, so that a last step of 1e-9, relative to the smaller of scale and x,
// leaves an error of rounding size.
template <typename Function>
double IncreasingRoot(const Function& function, double lower, double upper, double start,
                      double scale) {
  double x = start;
  for (int iteration = 0; iteration < 400; ++iteration) {
    const ValueAndSlope at_x = function(x);
    const double step = at_x.value / at_x.slope;
    if (std::abs(step) <= 1e-9 * std::min(std::abs(x), scale)) return x - step;
    (at_x.value < 0 ? lower : upper) = x;
    double next = x - step;
    // NaN is caught here, too: a probability that underflowed has no slope.
    if (!(next > lower && next < upper)) {
      next = std::isinf(upper) ? 2 * lower + scale : 0.5 * (lower + upper);
    }
    if (next == x) return x;
    x = next;
  }
  return x;
}

}  // namespace

// Uses lgamma_r, because the C library's lgamma writes a global sign, a race between threads.
double LogGamma(double x) {
  int sign = 0;
  return ::lgamma_r(x, &sign);
}

double LogBeta(double alpha, double beta) {
  return LogGamma(alpha) + LogGamma(beta) - LogGamma(alpha + beta);
}

double TimesLog(double factor, double x) { return factor == 0 ? 0 : factor * std::log(x); }

double IncompleteBeta(double alpha, double beta, double u) {
  if (u <= 0) return 0;
  if (u >= 1) return 1;
  return Eigen::numext::betainc(alpha, beta, u);
}

double LowerIncompleteGamma(double shape, double x) {
  if (x <= 0) return 0;
  return std::isinf(x) ? 1 : Eigen::numext::igamma(shape, x);
}

double UpperIncompleteGamma(double shape, double x) {
  if (x <= 0) return 1;
  return std::isinf(x) ? 0 : Eigen::numext::igammac(shape, x);
}

double LowerBetaQuantile(double alpha, double beta, double p) {
  const double log_beta = LogBeta(alpha, beta);
  const double log_p = std::log(p);
  const auto log_ratio = [&](double u) -> ValueAndSlope {
    const double probability = IncompleteBeta(alpha, beta, u);
    const double log_density = TimesLog(alpha - 1, u) + (beta - 1) * std::log1p(-u) - log_beta;
    return {std::log(probability) - log_p, std::exp(log_density) / probability};
  };
  // The start is not above the root, since β ≥ 1 gives I_u ≤ u^α / (α B).
  const double start = std::exp((log_p + std::log(alpha) + log_beta) / alpha);
  const double sum = alpha + beta;
  const double scale = std::sqrt(alpha * beta / (sum + 1)) / sum;
  return IncreasingRoot(log_ratio, 0, 1, std::min(start, 0.5), scale);
}

namespace {

double GammaDensity(double shape, double x) {
  return std::exp(TimesLog(shape - 1, x) - x - LogGamma(shape));
}

}  // namespace

double LowerGammaQuantile(double shape, double p) {
  const double log_p = std::log(p);
  const auto log_ratio = [&](double x) -> ValueAndSlope {
    const double probability = LowerIncompleteGamma(shape, x);
    return {std::log(probability) - log_p, GammaDensity(shape, x) / probability};
  };
  // The start is not above the root, since P ≤ x^a / Γ(a + 1). The median is below the mean.
  const double start = std::exp((log_p + LogGamma(shape + 1)) / shape);
  return IncreasingRoot(log_ratio, 0, shape, start, std::sqrt(shape));
}

double UpperGammaQuantile(double shape, double q) {
  const double log_q = std::log(q);
  const auto log_ratio = [&](double x) -> ValueAndSlope {
    const double probability = UpperIncompleteGamma(shape, x);
    return {log_q - std::log(probability), GammaDensity(shape, x) / probability};
  };
  return IncreasingRoot(log_ratio, 0, kInfinity, shape, std::sqrt(shape));
}

}  // namespace polyest::internal
