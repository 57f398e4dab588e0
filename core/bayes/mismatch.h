#pragma once

// The J_mismatch of several measured channels; noise of unknown size or correlation is
// marginalized.
//
// With u_k the residuals of a channel's N samples in units of its working noise (whitened with its
// working correlation), χ² = Σ u_k² and r = Σ u_k u_{k−1} ÷ Σ u_k² their lag-1 correlation, all
// functions of the germ through the sums, −log of the likelihood is, up to a constant,
//
//   noise known                        ½ χ²
//   scale s unknown, p(s) ∝ 1/s        ½ N (1 + log(χ²/N))          (∫ s^−N e^{−χ²/2s²} ds/s)
//   correlation unknown                ½ χ² (1 − r²)
//   both unknown                       ½ N (1 + log(χ²/N)) + ½ (N − 1) log(1 − r²)
//
// Unknown correlation is a further factor 1 − a B of the noise (B shifts by a sample), with a flat
// prior for a: ∫ e^{−½ Σ (u_k − a u_{k−1})²} da gives the last two lines. The constants are chosen
// so that a working noise of the right size gives N/2 in all cases.
//
// While a channel with outliers or with noise relative to the prediction has few samples, −log of
// their likelihood is taken sample by sample (robust_samples.h, relative_samples.h) and not from
// its sums, which hold near one point only.
//
// Where the variances S_k of the residuals depend on the germ, as those of a filter's innovations
// do, ½ Σ log(S_k/R_k) is added; noise is known then.
//
// Source: Zellner, An Introduction to Bayesian Inference in Econometrics (1971), ch. 3 and 4.

#include <memory>
#include <vector>

#include "core/bayes/mismatch_sums.h"
#include "core/bayes/relative_samples.h"
#include "core/bayes/robust_samples.h"
#include "core/common/types.h"

namespace polyest::internal {

// The floor of mean squared residuals in units of the working noise, at the level of rounding,
// which keeps the logarithms finite.
inline constexpr double kMinMeanSquare = 1e-24;

// Returns −log of the likelihood of one channel as above; +∞ if χ² is +∞. `degrees` is N or the
// degrees of freedom in its place; `differences` is Σ (u_k − u_{k−1})². For a channel with known
// noise `chi_squared` may include Σ log(S_k/R_k), with which it may be below 0.
double NegativeLogLikelihood(double degrees, double chi_squared, double differences,
                             bool scale_unknown, bool correlation_unknown);

// The sums over the history of one channel.
struct ChannelSums {
  explicit ChannelSums(int terms = 0) : samples(terms), differences(terms) {}

  MismatchSums samples;  // of u_k
  // The sums of u_k − u_{k−1}, and of u_k where a run begins and where it has ended. With the run
  // that has not, Σ (…)² = 2 Σ u_k² − 2 Σ u_k u_{k−1} − u² of the last sample.
  MismatchSums differences;
  // The coefficients l (S) of ½ Σ log(S_k/R_k) = lᵀφ, and its value at the reference; empty and 0
  // if the variances are those of the noise.
  Vector log_variance;
  double log_variance_at_reference = 0;
  bool scale_unknown = false;
  bool correlation_unknown = false;
  double degrees_factor = 1;  // BoundedDegreesFactor, see bayes/noise.h
  // χ² of the samples that count as outliers, at the point that decided on their weights, less
  // OutlierDegrees for each.
  double surplus = 0;
  double spent = 0;  // degrees of freedom used up by parameters that are eliminated

  bool IsKnown() const { return !scale_unknown && !correlation_unknown; }
  // Returns the expected χ² if the working noise is right, for the outliers that there are: N
  // without their handling, or less if parameters have been eliminated.
  double Degrees() const {
    return degrees_factor * static_cast<double>(samples.count()) + surplus - spent;
  }
  // Returns the χ² whose −log of the likelihood is that of `chi_squared` plus ½ L, L = Σ
  // log(R_k/R⁰_k) being `logs`. With known noise it may be below 0.
  double WithLogVariance(double chi_squared, double logs) const;
  // Returns by how much χ²/2 counts in the cost at d: N/χ² for an unknown scale, which is the one
  // that the residuals have there, and 1 for a known one.
  double Weight(const ConstVectorRef& d) const;
  // Returns r at d, in [−1, 1]; 0 without samples.
  double Lag1Correlation(const ConstVectorRef& d) const;
};

// Copies share the sums.
class Mismatch {
 public:
  // Takes the sums of channels with known noise.
  Mismatch(MismatchSums sums);  // NOLINT(google-explicit-constructor): the plain case
  // `kept` and `relative` have an element for each channel or none. The likelihood of a channel
  // whose element keeps samples is that of these in place of the sums. Channels with outliers then
  // have known noise, and those of relative noise no correlation.
  explicit Mismatch(const std::vector<ChannelSums>& channels,
                    const std::vector<RobustSamples>& kept = {},
                    const std::vector<RelativeSamples>& relative = {});

  int terms() const;

  // Returns J_mismatch at d = φ(η) − φ(η_0); `gradient` (S) is with respect to d.
  double Evaluate(const ConstVectorRef& d) const;
  double EvaluateWithGradient(const ConstVectorRef& d, VectorRef gradient) const;
  // Returns ∂φᵀ (∂²J/∂d²) ∂φ, n × n; `phi_gradient` = ∂φ is S × n. For `spent` see
  // Cost::MismatchHessian.
  Matrix Curvature(const ConstVectorRef& d, const ConstMatrixRef& phi_gradient,
                   double spent = 0) const;
  // Writes J_mismatch at W points into `values` (W); `differences` is W × S. `product` is scratch
  // memory.
  void EvaluateMany(const ConstMatrixRef& differences, Matrix& product, VectorRef values) const;

 private:
  struct Sums;

  std::shared_ptr<const Sums> sums_;
};

}  // namespace polyest::internal
