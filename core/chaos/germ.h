#pragma once

// Germs: the independent standard random variables ξ that carry all uncertainty (1)–(3).
//
//   normal          N(0, 1) on ℝ                                   Hermite
//   uniform         1/2 on [−1, 1]                                 Legendre
//   beta(α, β)      ∝ (1+ξ)^(α−1) (1−ξ)^(β−1) on [−1, 1]           Jacobi
//   gamma(shape)    ξ^(shape−1) e^(−ξ) / Γ(shape) on [0, ∞)        Laguerre
//   truncated normal(a, b)   N(0, 1) cut to [a, b]                 its own (truncated_normal.h)
//   exponential(rate)        ∝ e^(rate ξ) on [−1, 1]               its own (exponential.h)
//
// α and β are the statistician's parameters: the paper's "Beta(1,1)" is Beta(2, 2) here.

#include <limits>

#include "core/common/types.h"
#include "polyest/uncertain_parameter.h"

namespace polyest::internal {

// The monic three-term recurrence P_{k+1}(ξ) = (ξ − a_k) P_k(ξ) − b_k P_{k−1}(ξ) for
// k = 0 … count − 1; b_0 = 1 is the integral of the density.
struct RecurrenceCoefficients {
  Vector a;
  Vector b;
};

class Germ {
 public:
  // Makes the germ of a prior (UncertainParameter::germ).
  explicit Germ(const GermShape& shape);
  static Germ Normal();
  static Germ Uniform();
  // Requires alpha, beta ≥ 1: below 1 the density is infinite at a bound and has no mode.
  static Germ Beta(double alpha, double beta);
  // Requires shape ≥ 1, because below 1 the density is infinite at 0.
  static Germ Gamma(double shape);
  // Requires lower < upper (either may be infinite) and a probability of at least
  // kMinTruncatedProbability between them: with less, ξ lies so far out or in so narrow an
  // interval that its rounding matters.
  static Germ TruncatedNormal(double lower, double upper);
  static constexpr double kMinTruncatedProbability = 1e-6;
  // The highest degree of a truncated normal's polynomials that Recurrence computes.
  static constexpr int kMaxTruncatedNormalOrder = 100;

  // Requires 0 < rate ≤ kMaxRate, because its polynomials are accurate up to there.
  static Germ Exponential(double rate);
  static constexpr double kMaxRate = 5;

  GermFamily family() const { return family_; }
  operator GermShape() const { return {family_, first_shape_, second_shape_}; }
  // α of beta, shape of gamma, lower bound of truncated normal, rate of exponential, else 0
  double first_shape() const { return first_shape_; }
  // β of beta, upper bound of truncated normal, else 0
  double second_shape() const { return second_shape_; }
  double Lower() const;  // lower bound of the support Ω; −∞ for normal
  double Upper() const;  // upper bound of Ω; +∞ for normal and gamma
  double Mean() const;
  double StandardDeviation() const;
  double Mode() const;  // the centre of the support for uniform

  double Density(double xi) const;     // 0 outside the support
  double LogDensity(double xi) const;  // −∞ outside the support
  // Subtracts the log density at each ξ, a number, from the value of the same row.
  void SubtractLogDensities(const ConstVectorRef& xis, VectorRef values) const;
  // Derivatives of log ρ inside the open support.
  double LogDensityDerivative(double xi) const;
  double LogDensitySecondDerivative(double xi) const;
  double CumulativeProbability(double xi) const;
  // Returns the ξ with CumulativeProbability(ξ) = probability, 0 < probability < 1. Its error is at
  // most 1e-12 of the standard deviation for shapes up to 1000 and 1e-9 up to 1e5, because log Γ
  // rounds in proportion to shape · log(shape). Far beyond, the series of the incomplete beta and
  // gamma functions do not converge; priors have shapes up to 10,000.
  double Quantile(double probability) const;
  // Returns the ξ with CumulativeProbability(ξ) = Φ(score), Φ that of N(0, 1), accurate in both
  // tails. A score beyond ±kMaxScore, whose probability is 10⁻³⁰⁰, counts as ±kMaxScore.
  double OfNormalScore(double score) const;
  static constexpr double kMaxScore = 37;
  // Returns Φ⁻¹(CumulativeProbability(ξ)), the inverse of OfNormalScore; ∓∞ at a bound of the
  // support.
  double NormalScore(double xi) const;

  RecurrenceCoefficients Recurrence(int count) const;

  friend bool operator==(const Germ&, const Germ&) = default;

 private:
  Germ(GermFamily family, double first_shape, double second_shape);
  void TakeMoments();
  double UpperProbability(double xi) const;  // 1 − CumulativeProbability(ξ)
  // Quantiles counted from below and from above, 0 < probability ≤ ½.
  double LowerQuantile(double probability) const;
  double UpperQuantile(double probability) const;

  GermFamily family_;
  double first_shape_;
  double second_shape_;
  double log_normalization_ = 0;  // log of the density's constant factor
  double probability_ = 1;        // ∫_a^b φ of a truncated normal
  // The moments of a truncated normal and an exponential, which have no closed form free of
  // cancellation.
  double mean_ = 0;
  double standard_deviation_ = 1;
};

}  // namespace polyest::internal
