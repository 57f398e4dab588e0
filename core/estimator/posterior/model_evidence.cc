#include "core/estimator/posterior/model_evidence.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/bayes/log_sum_exp.h"
#include "core/bayes/weighted_samples.h"
#include "core/chaos/beta_gamma.h"
#include "core/chaos/normal.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/posterior/mixture_share.h"

namespace polyest::internal {
namespace {

// Returns log ½ Γ(½ degrees), which is log ∫ s^−degrees e^(−χ²/2s²) ds/s + ½ degrees log(χ²/2).
double LogOfScaleIntegral(double degrees) { return LogGamma(0.5 * degrees) - std::numbers::ln2; }

// Returns what −J_mismatch of the channel lacks to be the log of the likelihood, but for log σ of
// the working noise.
double LogConstant(const ChannelSums& sums) {
  const double n = sums.Degrees();
  const double gaussian = -0.5 * static_cast<double>(sums.samples.count()) * kLogTwoPi;
  if (n <= 1) return gaussian;
  // J leaves out ½ N log ½ − ½ N (1 − log N) of the integral over the scale, see mismatch.h.
  const double scale = 0.5 * n * (1 - std::log(0.5 * n));
  const double correlation = 0.5 * kLogTwoPi - std::numbers::ln2;  // with the density ½
  if (sums.scale_unknown && sums.correlation_unknown) {
    return gaussian + scale - 0.5 * std::numbers::ln2 + LogOfScaleIntegral(n - 1) + correlation;
  }
  if (sums.scale_unknown) return gaussian + scale + LogOfScaleIntegral(n);
  if (sums.correlation_unknown) return gaussian + correlation - 0.5 * std::log(n);
  return gaussian;
}

// Returns what the likelihood with the correlation integrated out has beside that without.
double LogOfCorrelation(const ChannelSums& sums, const Vector& d) {
  const double n = sums.Degrees();
  if (!sums.correlation_unknown || n <= 1) return 0;
  const double chi_squared = sums.samples.ChiSquared(d),
               differences = sums.differences.ChiSquared(d);
  const auto cost = [&](bool unknown) {
    return NegativeLogLikelihood(n, chi_squared, differences, sums.scale_unknown, unknown);
  };
  return cost(false) - cost(true) + 0.5 * kLogTwoPi - std::numbers::ln2 - 0.5 * std::log(n);
}

// Puts the density of samples with outliers in place of what the weighted sums make of it. About
// the predictions for which they were weighed it is known to second order, d being the difference
// of φ:
//   −log p − J_mismatch = constant + lᵀ d + ½ dᵀ M d,
// whose mean e^{−…} over draws of the posterior with the sums is the ratio of the integrals.
class DensityCorrection {
 public:
  DensityCorrection(const RegionalExpansion& expansion, const Cost& cost)
      : design_(expansion.design()), prior_(cost.prior()) {
    const Vector centre = expansion.CentreOfWeights();
    at_ = cost.BasisDifference(centre);
    centre_phi_.resize(at_.size());
    design_.basis->Evaluate(centre, centre_phi_);
    linear_.setZero(at_.size());
    square_.setZero(at_.size(), at_.size());
  }

  // Adds the channel; returns false if its density is not known well enough.
  bool Add(const ChannelSums& sums, const OutlierDensity& density) {
    if (sums.samples.count() == 0) return true;
    const std::optional<OutlierDensity::Value> value =
        sums.scale_unknown ? density.OfUnknownSize() : density.OfKnownSize();
    if (!value || !(value->curvature > 0)) return false;
    Vector by_d(at_.size());
    const double n = sums.Degrees(), chi_squared = sums.samples.ChiSquaredWithGradient(at_, by_d);
    log_density_ += NegativeLogLikelihood(n, chi_squared, 0, sums.scale_unknown, false) +
                    density.excess() + value->log_density + LogOfCorrelation(sums, at_);
    // The derivatives of ½ n log χ² are n/χ² of those of ½ χ².
    const double present = sums.scale_unknown ? n / chi_squared : 1;
    linear_ += 0.5 * (value->slope - present) * by_d;
    square_ += (value->curvature - present) * sums.samples.G();
    return true;
  }

  // Returns what to add to the log of the evidence; nothing if few of the draws have all the
  // weight.
  std::optional<double> Over(const PosteriorDraws& draws) const {
    if (draws.weights.size() == 0) return std::nullopt;
    const Matrix germs = draws.Germs(prior_)(EquallyWeighted(draws.weights, kDraws), Eigen::all);
    Matrix d;
    design_.basis->EvaluateMany(design_.region.ManyToLocal(germs), d);
    d.rowwise() -= centre_phi_.transpose();
    const Matrix product = d * square_;
    const Vector lack = d * linear_ + 0.5 * product.cwiseProduct(d).rowwise().sum();
    const double mean = LogSumExp(
        kDraws, [&](Eigen::Index i) { return -lack[i]; }, kDraws);
    const double square = LogSumExp(
        kDraws, [&](Eigen::Index i) { return -2 * lack[i]; }, kDraws);
    if (!(std::exp(2 * mean - square) > kMinEffectiveShare)) return std::nullopt;
    return log_density_ + mean;
  }

 private:
  static constexpr int kDraws = 4'000;
  static constexpr double kMinEffectiveShare = 0.05;

  const ExpansionDesign& design_;
  const Prior& prior_;
  Vector at_;          // φ(η) − φ(η_0) of the centre
  Vector centre_phi_;  // φ(η) of it
  Vector linear_;      // l, S
  Matrix square_;      // M, S × S
  double log_density_ = 0;
};

// Returns what −J of all channels lacks to be the log of the likelihood, but for HeightOf.
std::optional<double> LogConstants(const ResolvedProblem& problem,
                                   const RegionalExpansion& expansion, const Cost& cost,
                                   const PosteriorDraws& draws) {
  std::optional<DensityCorrection> correction;
  double constants = 0;
  for (size_t c = 0; c < expansion.sums().size(); ++c) {
    const ChannelSums& sums = expansion.sums()[c];
    const OutlierDensity* density = expansion.DensityOfWeighted(static_cast<int>(c));
    if (density == nullptr) {
      constants += LogConstant(sums);
      continue;
    }
    if (!correction) correction.emplace(expansion, cost);
    const bool learns = problem.problem().measured[c].noise.unknown;
    if (learns != sums.scale_unknown || !correction->Add(sums, *density)) return std::nullopt;
  }
  if (!correction) return constants;
  // Draws from a power of the likelihood are not where the density is.
  const std::optional<double> total =
      cost.power() == 1 ? correction->Over(draws) : std::optional<double>();
  if (!total) return std::nullopt;
  return constants + *total;
}

// Returns Laplace's approximation of log ∫ e^{−J} dξ, with the noise as stated.
double LaplaceIntegral(const RegionalExpansion& expansion, Cost cost, const ConstVectorRef& eta) {
  cost.set_power(1);
  const CholeskyFactor factor(cost.Hessian(eta));
  if (!factor.positive_definite()) return -kInfinity;
  return -cost.Evaluate(eta).total + 0.5 * cost.dimension() * kLogTwoPi -
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
  const std::optional<double> constants = LogConstants(problem, expansion, cost, draws);
  if (!constants || !std::isfinite(evidence + *constants)) return std::nullopt;
  return evidence + *constants;
}

std::optional<double> LogSumOfExponentials(const std::vector<std::optional<double>>& values) {
  if (values.empty() || !std::ranges::all_of(values, [](const auto& one) { return !!one; })) {
    return std::nullopt;
  }
  return LogSumExp(std::ssize(values),
                   [&](Eigen::Index i) { return *values[static_cast<size_t>(i)]; });
}

}  // namespace polyest::internal
