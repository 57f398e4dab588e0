#include "core/estimator/posterior/model_evidence.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/bayes/log_sum_exp.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/posterior/mixture_share.h"

namespace polyest::internal {
namespace {

constexpr double kLog2Pi = 1.8378770664093453;

// Returns log ½ Γ(½ degrees), which is log ∫ s^−degrees e^(−χ²/2s²) ds/s + ½ degrees log(χ²/2).
double LogOfScaleIntegral(double degrees) {
  int sign = 0;  // lgamma would write a global one, a race between threads
  return ::lgamma_r(0.5 * degrees, &sign) - std::numbers::ln2;
}

// Returns what −J_mismatch of the channel lacks to be the log of the likelihood, but for log σ of
// the working noise.
double LogConstant(const ChannelSums& sums) {
  const double n = sums.Degrees();
  const double gaussian = -0.5 * static_cast<double>(sums.samples.count()) * kLog2Pi;
  if (n <= 1) return gaussian;
  // J leaves out ½ N log ½ − ½ N (1 − log N) of the integral over the scale, see mismatch.h.
  const double scale = 0.5 * n * (1 - std::log(0.5 * n));
  const double correlation = 0.5 * kLog2Pi - std::numbers::ln2;  // with the density ½
  if (sums.scale_unknown && sums.correlation_unknown) {
    return gaussian + scale - 0.5 * std::numbers::ln2 + LogOfScaleIntegral(n - 1) + correlation;
  }
  if (sums.scale_unknown) return gaussian + scale + LogOfScaleIntegral(n);
  if (sums.correlation_unknown) return gaussian + correlation - 0.5 * std::log(n);
  return gaussian;
}

// Returns Laplace's approximation of log ∫ e^{−J} dξ, with the noise as stated.
double LaplaceIntegral(const RegionalExpansion& expansion, Cost cost, const ConstVectorRef& eta) {
  cost.set_power(1);
  const CholeskyFactor factor(cost.Hessian(eta));
  if (!factor.positive_definite()) return -kInfinity;
  return -cost.Evaluate(eta).total + 0.5 * cost.dimension() * kLog2Pi -
         factor.HalfLogDeterminant() + expansion.design().region.LogVolume();
}

}  // namespace

std::optional<double> LogModelEvidence(const ResolvedProblem& problem,
                                       const RegionalExpansion& expansion, const Cost& cost,
                                       const PosteriorDraws& draws, const ConstVectorRef& eta) {
  if (cost.regularization() != 1 || problem.ended_runs() != nullptr) return std::nullopt;
  double evidence = cost.power() == 1
                        ? ShareOf(expansion, cost, draws).log_evidence
                        : LaplaceIntegral(expansion, cost, eta) - HeightOf(expansion, cost);
  for (const ChannelSums& sums : expansion.sums()) evidence += LogConstant(sums);
  if (!std::isfinite(evidence)) return std::nullopt;
  return evidence;
}

std::optional<double> LogSumOfExponentials(const std::vector<std::optional<double>>& values) {
  if (values.empty() || !std::ranges::all_of(values, [](const auto& one) { return !!one; })) {
    return std::nullopt;
  }
  return LogSumExp(std::ssize(values),
                   [&](Eigen::Index i) { return *values[static_cast<size_t>(i)]; });
}

}  // namespace polyest::internal
