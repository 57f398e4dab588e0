#pragma once

// Germs: the independent standard random variables ξ that carry all uncertainty (1)–(3).
//
//   normal          N(0, 1) on ℝ                                   Hermite
//   uniform         1/2 on [−1, 1]                                 Legendre
//   beta(α, β)      ∝ (1+ξ)^(α−1) (1−ξ)^(β−1) on [−1, 1]           Jacobi
//   gamma(shape)    ξ^(shape−1) e^(−ξ) / Γ(shape) on [0, ∞)        Laguerre
//   truncated normal(a, b)   N(0, 1) cut to [a, b]                 its own (truncated_normal.h)
//
// α and β are the statistician's: the paper's "Beta(1,1)" is Beta(2, 2) here.

#include <limits>

#include "core/common/types.h"

namespace polyest {

enum class GermFamily { kNormal, kUniform, kBeta, kGamma, kTruncatedNormal };

// Monic three-term recurrence P_{k+1}(ξ) = (ξ − a_k) P_k(ξ) − b_k P_{k−1}(ξ), k = 0 … count − 1;
// b_0 = 1, the integral of the density.
struct RecurrenceCoefficients {
  Vector a;
  Vector b;
};

class Germ {
 public:
  static Germ Normal();
  static Germ Uniform();
  // Up to this shape the cumulative probabilities and quantiles keep their accuracy; far beyond it
  // the incomplete beta and gamma functions run out of terms. Larger ones are the caller's to
  // refuse.
  static constexpr double kMostShape = 1e5;
  // alpha, beta ≥ 1: below 1 the density is infinite at a bound and has no most likely value.
  static Germ Beta(double alpha, double beta);
  // shape ≥ 1, for the same reason.
  static Germ Gamma(double shape);
  // lower < upper, either may be infinite, with a probability of at least 1e-6 between them: with
  // less the germ is so far out or so narrow that ξ itself rounds too much.
  static Germ TruncatedNormal(double lower, double upper);
  static constexpr double kLeastTruncatedProbability = 1e-6;
  // The most polynomials of a truncated normal that Recurrence knows, less one.
  static constexpr int kMostTruncatedNormalOrder = 100;

  GermFamily family() const { return family_; }
  // α of beta, shape of gamma, lower bound of truncated normal, else 0
  double first_shape() const { return first_shape_; }
  // β of beta, upper bound of truncated normal, else 0
  double second_shape() const { return second_shape_; }
  double Lower() const;  // of the support Ω; −∞ for normal
  double Upper() const;  // +∞ for normal and gamma
  double Mean() const;
  double StandardDeviation() const;
  double Mode() const;  // the centre of the support for uniform

  double Density(double xi) const;     // 0 outside the support
  double LogDensity(double xi) const;  // −∞ outside the support
  // Derivatives of log ρ inside the open support.
  double LogDensityDerivative(double xi) const;
  double LogDensitySecondDerivative(double xi) const;
  double CumulativeProbability(double xi) const;
  // The ξ with CumulativeProbability(ξ) = probability, 0 < probability < 1, to 1e-12 of the
  // standard deviation for shapes up to 1000 and to 1e-9 up to kMostShape: log Γ rounds in
  // proportion to shape · log(shape).
  double Quantile(double probability) const;
  // The ξ with CumulativeProbability(ξ) = Φ(score), Φ that of N(0, 1): as Quantile, but exact in
  // the upper tail too. |score| ≤ kMostScore; what lies beyond, with probability 10⁻³⁰⁰, is taken
  // for kMostScore.
  double OfNormalScore(double score) const;
  static constexpr double kMostScore = 37;
  // The inverse, Φ⁻¹(CumulativeProbability(ξ)); ∓∞ at a bound of the support.
  double NormalScore(double xi) const;

  RecurrenceCoefficients Recurrence(int count) const;

  friend bool operator==(const Germ&, const Germ&) = default;

 private:
  Germ(GermFamily family, double first_shape, double second_shape);
  double UpperProbability(double xi) const;  // 1 − CumulativeProbability(ξ)
  // Of probabilities 0 < p ≤ ½, from below and from above.
  double LowerQuantile(double probability) const;
  double UpperQuantile(double probability) const;

  GermFamily family_;
  double first_shape_;
  double second_shape_;
  double log_normalization_ = 0;  // log of the density's constant factor
  // Of a truncated normal: ∫_a^b φ and moments, which have no closed form free of cancellation.
  double probability_ = 1;
  double mean_ = 0;
  double standard_deviation_ = 1;
};

}  // namespace polyest
