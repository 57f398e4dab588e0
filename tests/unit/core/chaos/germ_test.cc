#include "core/chaos/germ.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "core/chaos/gauss_rule.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

const std::vector<Germ>& AllGerms() {
  static const std::vector<Germ> germs = {
      Germ::Normal(), Germ::Uniform(), Germ::Beta(2, 2), Germ::Beta(1, 1), Germ::Beta(1.5, 4.2),
      Germ::Beta(1, 3), Germ::Beta(30, 2.5), Germ::Gamma(1), Germ::Gamma(2.7), Germ::Gamma(50),
      // The truncations are lopsided, one-sided, far out in a tail, narrow, and nearly without
      // effect.
      Germ::TruncatedNormal(-1, 2.5), Germ::TruncatedNormal(-kInfinity, 0.3),
      Germ::TruncatedNormal(4.5, kInfinity), Germ::TruncatedNormal(0.4, 0.401),
      Germ::TruncatedNormal(-9, kInfinity),
      // nearly uniform, and nearly without its lower half
      Germ::Exponential(1e-3), Germ::Exponential(1.2), Germ::Exponential(Germ::kMaxRate)};
  return germs;
}

std::string Name(const Germ& germ) {
  return "family " + std::to_string(static_cast<int>(germ.family())) + " (" +
         std::to_string(germ.first_shape()) + ", " + std::to_string(germ.second_shape()) + ")";
}

// Returns ∫ f ρ dξ by the trapezoidal rule. A substitution makes the integrand fall off doubly
// exponentially at both ends, where that rule converges exponentially. It uses the density alone.
double Integral(const Germ& germ, const std::function<double(double)>& f) {
  constexpr double kStep = 1.0 / 64;
  double sum = 0;
  for (int i = -12 * 64; i <= 12 * 64; ++i) {
    const double t = i * kStep;
    double xi = t, slope = 1;
    const bool below = std::isfinite(germ.Lower()), above = std::isfinite(germ.Upper());
    if (below != above) {  // away from the only bound
      const double distance = std::exp(t - std::exp(-t));
      xi = below ? germ.Lower() + distance : germ.Upper() - distance;
      slope = distance * (1 + std::exp(-t));
    } else if (below) {
      const double s = std::numbers::pi / 2 * std::sinh(t);
      const double half = 0.5 * (germ.Upper() - germ.Lower());
      xi = 0.5 * (germ.Upper() + germ.Lower()) + half * std::tanh(s);
      slope = half * std::numbers::pi / 2 * std::cosh(t) / (std::cosh(s) * std::cosh(s));
    }
    const double density = germ.Density(xi) * slope;
    if (density > 1e-280) sum += kStep * density * f(xi);
  }
  return sum;
}

// Returns P_0 … P_order at ξ by the recurrence, of which more than `order` coefficients are given.
Vector Polynomials(const RecurrenceCoefficients& recurrence, int order, double xi) {
  Vector values(order + 1);
  values[0] = 1;
  for (int k = 0; k < order; ++k) {
    double next = (xi - recurrence.a[k]) * values[k];
    if (k > 0) next -= std::sqrt(recurrence.b[k]) * values[k - 1];
    values[k + 1] = next / std::sqrt(recurrence.b[k + 1]);
  }
  return values;
}

Vector Polynomials(const Germ& germ, int order, double xi) {
  return Polynomials(germ.Recurrence(order + 1), order, xi);
}

TEST(Germ, DensityHasUnitAreaAndTheStatedMoments) {
  for (const Germ& germ : AllGerms()) {
    SCOPED_TRACE(Name(germ));
    EXPECT_NEAR(Integral(germ, [](double) { return 1; }), 1, 1e-12);
    const double mean = germ.Mean(), deviation = germ.StandardDeviation();
    EXPECT_NEAR(Integral(germ, [](double xi) { return xi; }), mean, 1e-12 * (1 + std::abs(mean)));
    EXPECT_NEAR(Integral(germ, [&](double xi) { return (xi - mean) * (xi - mean); }),
                deviation * deviation, 1e-12 * (1 + mean * mean));
  }
}

TEST(Germ, PolynomialsAreOrthonormalUnderTheDensityUpToOrderTen) {
  for (const Germ& germ : AllGerms()) {
    SCOPED_TRACE(Name(germ));
    const RecurrenceCoefficients recurrence = germ.Recurrence(11);
    for (int i = 0; i <= 10; ++i) {
      for (int j = 0; j <= i; ++j) {
        const double product = Integral(germ, [&](double xi) {
          const Vector values = Polynomials(recurrence, i, xi);
          return values[i] * values[j];
        });
        // The rounding error grows with the cancellation between the lobes of the integrand.
        EXPECT_NEAR(product, i == j ? 1 : 0, 1e-9) << i << ", " << j;
      }
    }
  }
}

TEST(Germ, PolynomialsAreTheTextbookOnes) {
  for (const double x : {-0.9, -0.3, 0.0, 0.4, 1.0}) {
    // The polynomial is Hermite's He_5 / √5!.
    EXPECT_NEAR(Polynomials(Germ::Normal(), 5, x)[5],
                (std::pow(x, 5) - 10 * std::pow(x, 3) + 15 * x) / std::sqrt(120), 1e-14);
    // The polynomial is Legendre's √7 (5x³ − 3x)/2.
    EXPECT_NEAR(Polynomials(Germ::Uniform(), 3, x)[3], std::sqrt(7) * (5 * x * x * x - 3 * x) / 2,
                1e-14);
    // The polynomials under ¾(1 − x²) are √5 x, √(7/8)(5x² − 1), √(15/8)(7x³ − 3x): the paper's
    // (40)–(41), corrected.
    const Vector jacobi = Polynomials(Germ::Beta(2, 2), 3, x);
    EXPECT_NEAR(jacobi[1], std::sqrt(5) * x, 1e-14);
    EXPECT_NEAR(jacobi[2], std::sqrt(7.0 / 8) * (5 * x * x - 1), 1e-14);
    EXPECT_NEAR(jacobi[3], std::sqrt(15.0 / 8) * (7 * x * x * x - 3 * x), 1e-13);
    // The polynomials are Laguerre's (x³ − 9x² + 18x − 6)/6 and the generalized (x² − 6x +
    // 6)/(2√3).
    const double y = 1 + x;
    EXPECT_NEAR(Polynomials(Germ::Gamma(1), 3, y)[3], (y * y * y - 9 * y * y + 18 * y - 6) / 6,
                1e-14);
    EXPECT_NEAR(Polynomials(Germ::Gamma(2), 2, y)[2],
                (y * y - 6 * y + 6) / (2 * std::numbers::sqrt3), 1e-14);
  }
}

TEST(Germ, BetaOneOneIsUniform) {
  const Germ beta = Germ::Beta(1, 1), uniform = Germ::Uniform();
  EXPECT_TRUE(beta.Recurrence(8).a.isZero(0));
  EXPECT_TRUE(beta.Recurrence(8).b.isApprox(uniform.Recurrence(8).b, 1e-15));
  EXPECT_EQ(beta.Mode(), 0);
  EXPECT_NEAR(beta.Density(-1), 0.5, 1e-15);
  EXPECT_NEAR(beta.Quantile(0.3), -0.4, 1e-14);
}

TEST(Germ, LogDensityDerivativesAreThoseOfTheLogDensity) {
  for (const Germ& germ : AllGerms()) {
    SCOPED_TRACE(Name(germ));
    for (const double p : {0.1, 0.5, 0.8}) {
      const double xi = germ.Quantile(p), h = 1e-3 * germ.StandardDeviation();
      const auto difference = [&](auto f) {  // Five points have the error O(h⁴).
        return (f(xi - 2 * h) - 8 * f(xi - h) + 8 * f(xi + h) - f(xi + 2 * h)) / (12 * h);
      };
      const double scale = 1 / germ.StandardDeviation();
      EXPECT_NEAR(germ.LogDensityDerivative(xi),
                  difference([&](double x) { return germ.LogDensity(x); }), 1e-7 * scale);
      EXPECT_NEAR(germ.LogDensitySecondDerivative(xi),
                  difference([&](double x) { return germ.LogDensityDerivative(x); }),
                  1e-7 * scale * scale);
    }
  }
}

TEST(Germ, ModeIsWhereTheDensityIsLargest) {
  for (const Germ& germ : AllGerms()) {
    const double mode = germ.Mode(), step = 0.01 * germ.StandardDeviation();
    EXPECT_GE(germ.Density(mode), germ.Density(mode - step)) << Name(germ);
    EXPECT_GE(germ.Density(mode), germ.Density(mode + step)) << Name(germ);
  }
}

TEST(Germ, DensityVanishesOutsideTheSupport) {
  EXPECT_EQ(Germ::Uniform().Density(1.0001), 0);
  EXPECT_EQ(Germ::Beta(2, 3).Density(-1.0001), 0);
  EXPECT_EQ(Germ::Gamma(2).Density(-1e-9), 0);
  EXPECT_EQ(Germ::Beta(2, 3).LogDensity(1), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(Germ::Gamma(1).Density(0), 1);
}

TEST(Germ, CumulativeProbabilitiesAgreeWithClosedForms) {
  for (const double u : {1e-8, 0.01, 0.3, 0.5, 0.77, 0.999}) {
    const double xi = 2 * u - 1;  // ξ is rounded; v is the u that it stands for.
    const double v = (1 + xi) / 2;
    EXPECT_NEAR(Germ::Beta(2, 2).CumulativeProbability(xi) / (v * v * (3 - 2 * v)), 1, 1e-13);
    EXPECT_NEAR(Germ::Beta(5, 1).CumulativeProbability(xi) / std::pow(v, 5), 1, 1e-13);
    EXPECT_NEAR(Germ::Beta(1, 7).CumulativeProbability(xi) / -std::expm1(7 * std::log1p(-v)), 1,
                1e-13);
  }
  for (const double x : {1e-8, 0.1, 1.0, 4.0, 30.0}) {
    EXPECT_NEAR(Germ::Gamma(1).CumulativeProbability(x) / -std::expm1(-x), 1, 1e-13);
    // The closed form P(3/2, x) = erf √x − 2 √(x/π) e^(−x) cancels for small x.
    if (x > 0.01) {
      EXPECT_NEAR(Germ::Gamma(1.5).CumulativeProbability(x),
                  std::erf(std::sqrt(x)) - 2 * std::sqrt(x / std::numbers::pi) * std::exp(-x),
                  1e-14);
    }
  }
  EXPECT_NEAR(Germ::Normal().CumulativeProbability(-10) / 7.619853024160527e-24, 1, 1e-13);
}

TEST(Germ, QuantilesAreThePublishedOnes) {
  EXPECT_NEAR(Germ::Normal().Quantile(0.975), 1.959963984540054, 1e-14);
  EXPECT_NEAR(Germ::Normal().Quantile(0.5), 0, 1e-15);
  EXPECT_NEAR(Germ::Normal().Quantile(1e-10), -6.361340902404056, 1e-13);
  // The 95 % quantile of χ² with 10 degrees of freedom is 18.307038053275146 = 2 · Gamma(5).
  EXPECT_NEAR(2 * Germ::Gamma(5).Quantile(0.95), 18.307038053275146, 1e-12);
  for (const double p : {1e-12, 1e-6, 0.2, 0.5, 0.50001, 0.9, 1 - 1e-9}) {
    EXPECT_NEAR(Germ::Gamma(1).Quantile(p) / -std::log1p(-p), 1, 1e-13) << p;
    // The root of u²(3 − 2u) = p is u = ½ + sin(asin(2p − 1)/3). The rounding of 2p − 1 reaches the
    // arcsine divided by 2√(p(1 − p)).
    EXPECT_NEAR(Germ::Beta(2, 2).Quantile(p), 2 * std::sin(std::asin(2 * p - 1) / 3),
                1e-15 + 1e-16 / std::sqrt(p * (1 - p)))
        << p;
  }
}

TEST(Germ, QuantileInvertsCumulativeProbability) {
  for (const Germ& germ : AllGerms()) {
    SCOPED_TRACE(Name(germ));
    for (const double p : {1e-10, 1e-6, 0.001, 0.1, 0.4, 0.5, 0.6, 0.9, 0.999, 1 - 1e-6}) {
      const double xi = germ.Quantile(p);
      ASSERT_GT(xi, germ.Lower());
      ASSERT_LT(xi, germ.Upper());
      // The bound allows an error of 1e-12 standard deviations in ξ, and the rounding of the
      // probability.
      const double allowed = germ.Density(xi) * 1e-12 * germ.StandardDeviation() + 1e-14 * p;
      EXPECT_NEAR(germ.CumulativeProbability(xi), p, allowed + 2e-16) << p;
    }
  }
}

TEST(Germ, QuantileKeepsTheFarTails) {
  for (const Germ& germ : AllGerms()) {
    SCOPED_TRACE(Name(germ));
    for (const double p : {1e-300, 1e-100, 1 - 1e-15}) {
      const double xi = germ.Quantile(p);
      EXPECT_TRUE(std::isfinite(xi));
      EXPECT_GE(xi, germ.Lower());
      EXPECT_LE(xi, germ.Upper());
    }
    EXPECT_LE(germ.Quantile(1e-300), germ.Quantile(1e-100));
    EXPECT_LE(germ.Quantile(1e-100), germ.Quantile(1e-10));
  }
}

TEST(Germ, QuantileFollowsTheNormalLimitForLargeShapes) {
  // The cube-root approximation of the gamma quantile by Wilson and Hilferty is exact to O(1/shape)
  // standard deviations.
  const double shape = 1e4, z = 1.959963984540054;
  const double cube = 1 - 1 / (9 * shape) + z / (3 * std::sqrt(shape));
  EXPECT_NEAR(Germ::Gamma(shape).Quantile(0.975), shape * cube * cube * cube, 1e-2);
  // A beta density of equal large shapes is normal with the same standard deviation, to O(1/shape).
  const Germ beta = Germ::Beta(1e4, 1e4);
  EXPECT_NEAR(beta.Quantile(0.975) / beta.StandardDeviation(), z, 1e-3);
}

TEST(Germ, KeepsItsAccuracyUpToTheLargestShape) {
  for (const double shape : {1e3, 1e4, 1e5}) {
    // The closed form is P(a, a) = ½ + 1/(3 √(2πa)) + O(a^(−3/2)); by symmetry I_½(a, a) = ½.
    const double expected = 0.5 + 1 / (3 * std::sqrt(2 * std::numbers::pi * shape));
    const double allowed = 1e-9 + std::pow(shape, -1.5);
    EXPECT_NEAR(Germ::Gamma(shape).CumulativeProbability(shape), expected, allowed);
    EXPECT_NEAR(Germ::Beta(shape, shape).CumulativeProbability(0), 0.5, 1e-9);
    for (const Germ& germ : {Germ::Gamma(shape), Germ::Beta(shape, 3)}) {
      for (const double p : {1e-6, 0.3, 0.99}) {
        EXPECT_NEAR(germ.CumulativeProbability(germ.Quantile(p)), p, 1e-9) << Name(germ);
      }
    }
  }
}

// The oracle is the textbook's closed form: with Z = Φ(b) − Φ(a), the mean is (φ(a) − φ(b))/Z and
// the variance 1 + (aφ(a) − bφ(b))/Z − mean² (Robert).
TEST(TruncatedNormal, HasTheClosedFormsMoments) {
  const Germ normal = Germ::Normal();
  for (const auto& [a, b] : {std::pair{-1.0, 2.5}, {-3.0, 0.5}, {0.5, 4.0}}) {
    const double z = normal.CumulativeProbability(b) - normal.CumulativeProbability(a);
    const double mean = (normal.Density(a) - normal.Density(b)) / z;
    const double variance = 1 + (a * normal.Density(a) - b * normal.Density(b)) / z - mean * mean;
    EXPECT_NEAR(Germ::TruncatedNormal(a, b).Mean(), mean, 1e-13);
    EXPECT_NEAR(Germ::TruncatedNormal(a, b).StandardDeviation(), std::sqrt(variance), 1e-13);
  }
  // The half-normal has the mean √(2/π) and the variance 1 − 2/π.
  const Germ half = Germ::TruncatedNormal(0, kInfinity);
  EXPECT_NEAR(half.Mean(), std::sqrt(2 / std::numbers::pi), 1e-14);
  EXPECT_NEAR(half.StandardDeviation(), std::sqrt(1 - 2 / std::numbers::pi), 1e-14);
}

TEST(TruncatedNormal, WithoutBoundsIsNormalAndWithNarrowOnesUniform) {
  const RecurrenceCoefficients whole = Germ::TruncatedNormal(-kInfinity, kInfinity).Recurrence(30);
  EXPECT_LT(whole.a.cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_TRUE(whole.b.isApprox(Germ::Normal().Recurrence(30).b, 1e-11));
  // The density changes over [−h, h] by h²/2 of itself.
  const double h = 1e-4;
  const RecurrenceCoefficients narrow = Germ::TruncatedNormal(-h, h).Recurrence(12);
  EXPECT_TRUE(narrow.b.tail(11).isApprox(h * h * Germ::Uniform().Recurrence(12).b.tail(11), h * h));
}

// Integrates in panels of 1/50. Eight Gauss–Legendre nodes in each are exact to rounding for
// polynomials whose zeros lie no closer.
TEST(TruncatedNormal, HasAsManyOrthonormalPolynomialsAsItSays) {
  const int order = Germ::kMaxTruncatedNormalOrder;
  const GaussRule rule = MakeGaussRule(Germ::Uniform(), 8);
  const double width = 0.02;
  const Germ germ = Germ::TruncatedNormal(-1, kInfinity);
  const RecurrenceCoefficients recurrence = germ.Recurrence(order + 1);
  double square = 0, product = 0;
  for (int panel = 0; panel < 38 * 50; ++panel) {
    for (int i = 0; i < 8; ++i) {
      const double xi = -1 + width * (panel + 0.5 * (1 + rule.nodes[i]));
      double value = 1, before = 0;
      for (int k = 0; k < order; ++k) {
        const double next = (xi - recurrence.a[k]) * value - std::sqrt(recurrence.b[k]) * before;
        before = value;
        value = next / std::sqrt(recurrence.b[k + 1]);
      }
      const double weight = width * rule.weights[i] * germ.Density(xi);
      square += weight * value * value;
      product += weight * value * before;
    }
  }
  EXPECT_NEAR(square, 1, 1e-9);
  EXPECT_NEAR(product, 0, 1e-9);
}

TEST(TruncatedNormal, QuantileKeepsBothTails) {
  const Germ germ = Germ::TruncatedNormal(-kInfinity, 3);
  // The tail is P(ξ < −20 | ξ < 3) = Φ(−20)/Φ(3).
  const double tail = Germ::Normal().CumulativeProbability(-20) / 0.99865010196836991;
  EXPECT_NEAR(germ.Quantile(tail), -20, 1e-12);
  EXPECT_NEAR(germ.CumulativeProbability(-20) / tail, 1, 1e-12);
  // The density beyond 4.5 is nearly e^{−4.5 (ξ − 4.5)}.
  EXPECT_NEAR(Germ::TruncatedNormal(4.5, kInfinity).Quantile(1e-9), 4.5 + 1e-9 / 4.7, 1e-10);
}

TEST(Germ, NormalScoresMapThereAndBackInBothTails) {
  for (const Germ& germ : AllGerms()) {
    SCOPED_TRACE(Name(germ));
    EXPECT_NEAR(germ.NormalScore(germ.Quantile(0.2)), Germ::Normal().Quantile(0.2), 1e-8);
    for (const double score : {-5.0, -1.0, 0.0, 0.5, 3.0, 5.0}) {
      const double xi = germ.OfNormalScore(score);
      // The rounding of ξ appears in the score multiplied by dz/dξ = ρ/φ.
      const double rounding =
          4e-16 * (std::abs(xi) + 1) * germ.Density(xi) / Germ::Normal().Density(score);
      EXPECT_NEAR(germ.NormalScore(xi), score, 1e-11 + 4 * rounding) << score;
    }
    EXPECT_LE(germ.OfNormalScore(-40), germ.OfNormalScore(-30));
    EXPECT_GE(germ.OfNormalScore(40), germ.OfNormalScore(30));
    EXPECT_TRUE(std::isnan(germ.OfNormalScore(std::nan(""))));
    EXPECT_TRUE(std::isfinite(germ.OfNormalScore(1000)));
  }
  // The score is exact even though 1 − p has rounded to 0: 1 − e^{−x} = Φ(20), x = −log Φ(−20).
  EXPECT_NEAR(Germ::Gamma(1).OfNormalScore(20), 203.91715537109727, 1e-9);
}

TEST(GaussRule, IntegratesPolynomialsExactly) {
  for (const Germ& germ : AllGerms()) {
    SCOPED_TRACE(Name(germ));
    const GaussRule rule = MakeGaussRule(germ, 5);
    EXPECT_NEAR(rule.weights.sum(), 1, 1e-13);
    const double mean = germ.Mean(), scale = germ.StandardDeviation();
    for (int degree = 1; degree <= 9; ++degree) {
      const auto power = [&](double xi) { return std::pow((xi - mean) / scale, degree); };
      double sum = 0, magnitude = 0;
      for (int i = 0; i < 5; ++i) {
        sum += rule.weights[i] * power(rule.nodes[i]);
        magnitude += rule.weights[i] * std::abs(power(rule.nodes[i]));
      }
      EXPECT_NEAR(sum, Integral(germ, power), 1e-11 * magnitude) << degree;
    }
  }
}

TEST(GaussRule, OfThreeLegendreNodesIsTheTextbookOne) {
  const GaussRule rule = MakeGaussRule(Germ::Uniform(), 3);
  EXPECT_NEAR(rule.nodes[0], -std::sqrt(0.6), 1e-14);
  EXPECT_NEAR(rule.nodes[1], 0, 1e-14);
  EXPECT_NEAR(rule.weights[0], 5.0 / 18, 1e-14);
  EXPECT_NEAR(rule.weights[1], 8.0 / 18, 1e-14);
}

TEST(GermCheck, ShapesBelowOneAndCertainProbabilitiesAreProgrammersErrors) {
  EXPECT_THROW(Germ::Beta(0.5, 2), CheckFailure);
  EXPECT_THROW(Germ::Gamma(0.9), CheckFailure);
  EXPECT_THROW(Germ::Uniform().Quantile(0), CheckFailure);
  EXPECT_THROW(Germ::TruncatedNormal(2, 2), CheckFailure);
  EXPECT_THROW(Germ::TruncatedNormal(8, 9), CheckFailure);
}

}  // namespace
}  // namespace polyest::internal
