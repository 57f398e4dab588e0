// Posteriors with four separate modes and four or more unknowns. The outputs
//   y_k = a² sin t_k + b² cos t_k + Σ_j c_j x_j(t_k) + ε_k
// are linear in the c_j, over which the density is integrated in closed form. The exact marginal
// density of a and b is left on a grid of spacing 0.01, which is less than half a standard
// deviation of every mode: the trapezoidal rule is then exact to many digits.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <random>

#include "core/estimator/expansion/guarded_importance.h"
#include "core/estimator/expansion/reexpansion_particles.h"
#include "core/estimator/posterior/posterior_draws.h"
#include "tests/unit/core/bayes/many_parameters.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal {
namespace {

constexpr int kRowsOfSquares = 15;

struct SquaresCase {
  int linear;     // number of the c_j
  double mean_a;  // of the priors, whose standard deviations are 1; those of c_j are 0
  double mean_b;
  double noise;
  unsigned seed;
};

double Regressor(int j, double t) {
  const std::array<double, 4> all{1, std::sin(2 * t), std::cos(2 * t), t};
  return all.at(static_cast<size_t>(j));
}

double TimeOfRow(int k) { return 0.3 * (k + 1); }

Vector MeasuredSquares(const SquaresCase& one) {
  std::mt19937_64 generator(one.seed);
  std::normal_distribution<double> normal;
  const Vector c = Vector::NullaryExpr(one.linear, [&] { return 0.3 * normal(generator); });
  Vector z(kRowsOfSquares);
  for (int k = 0; k < kRowsOfSquares; ++k) {
    const double t = TimeOfRow(k);
    z[k] = 0.81 * std::sin(t) + 1.21 * std::cos(t) + one.noise * normal(generator);
    for (int j = 0; j < one.linear; ++j) z[k] += c[j] * Regressor(j, t);
  }
  return z;
}

Cost CostOfSquares(const SquaresCase& one) {
  const Vector z = MeasuredSquares(one);
  std::vector<Measurement> measurements;
  for (int k = 0; k < kRowsOfSquares; ++k) {
    const auto output = [one, t = TimeOfRow(k)](const Vector& xi) {
      const double a = one.mean_a + xi[0], b = one.mean_b + xi[1];
      double y = a * a * std::sin(t) + b * b * std::cos(t);
      for (int j = 0; j < one.linear; ++j) y += xi[2 + j] * Regressor(j, t);
      return y;
    };
    measurements.push_back({output, z[k], one.noise});
  }
  return CostOf(ManyNormals(2 + one.linear), measurements);
}

// The probabilities of the signs of a and b: ++, +−, −+, −−.
using Signs = std::array<double, 4>;

size_t SignOf(double a, double b) { return (a > 0 ? 0U : 2U) + (b > 0 ? 0U : 1U); }

Signs ExactSigns(const SquaresCase& one) {
  Matrix squares(kRowsOfSquares, 2), linear(kRowsOfSquares, one.linear);
  for (int k = 0; k < kRowsOfSquares; ++k) {
    squares.row(k) << std::sin(TimeOfRow(k)), std::cos(TimeOfRow(k));
    for (int j = 0; j < one.linear; ++j) linear(k, j) = Regressor(j, TimeOfRow(k));
  }
  const Matrix variance = linear * linear.transpose() +
                          one.noise * one.noise * Matrix::Identity(kRowsOfSquares, kRowsOfSquares);
  const Eigen::LLT<Matrix> factor(variance);
  const Eigen::Matrix2d curvature = squares.transpose() * factor.solve(squares);
  const Eigen::Vector2d slope = squares.transpose() * factor.solve(MeasuredSquares(one));
  const Eigen::Vector2d least = curvature.inverse() * slope;
  Signs signs{};
  double sum = 0;
  for (double a = -3.005; a < 3.01; a += 0.01) {
    for (double b = -3.005; b < 3.01; b += 0.01) {
      const Eigen::Vector2d away = Eigen::Vector2d(a * a, b * b) - least;
      const double prior = std::pow(a - one.mean_a, 2) + std::pow(b - one.mean_b, 2);
      const double density = std::exp(-0.5 * (away.dot(curvature * away) + prior));
      signs.at(SignOf(a, b)) += density;
      sum += density;
    }
  }
  for (double& sign : signs) sign /= sum;
  return signs;
}

ExpansionDesign DesignOfSquares(const SquaresCase& one) {
  const int n = 2 + one.linear;
  ExpansionDesign design;
  design.region = Region::WholePrior(n);
  const auto [lower, upper] = TrustedRange(Germ::Normal());
  design.lower = Vector::Constant(n, lower);
  design.upper = Vector::Constant(n, upper);
  return design;
}

void ExpectSigns(const SquaresCase& one, const Matrix& xis, const Vector& weights,
                 double tolerance) {
  Signs signs{};
  for (Eigen::Index i = 0; i < xis.rows(); ++i) {
    signs.at(SignOf(one.mean_a + xis(i, 0), one.mean_b + xis(i, 1))) += weights[i];
  }
  const Signs exact = ExactSigns(one);
  for (size_t s = 0; s < signs.size(); ++s) {
    EXPECT_NEAR(signs.at(s), exact.at(s), tolerance) << "seed " << one.seed << " sign " << s;
  }
}

// Of moderate and of small noise; in the first the modes are far from Gaussian.
const std::array<SquaresCase, 4> kSquares{{{4, 0.3, -0.3, 0.2, 16},
                                           {4, 0.1, -0.1, 0.05, 20},
                                           {4, 0.4, 0.4, 0.05, 24},
                                           {2, 0.8, -0.2, 0.05, 3}}};

// Four standard errors of a thousand independent particles of probability ½.
TEST(SeparateModes, HaveTheirSharesOfTheParticles) {
  for (const SquaresCase& one : kSquares) {
    const Particles particles = SampleForReexpansion(CostOfSquares(one), DesignOfSquares(one),
                                                     Matrix(0, 2 + one.linear), 1, Stop())
                                    .value();
    const Eigen::Index count = particles.etas.rows();
    ExpectSigns(one, particles.etas, Vector::Constant(count, 1.0 / static_cast<double>(count)),
                4 * std::sqrt(0.25 / 1000));
  }
}

// Four standard errors of the two thousand particles from which chains start; draws of importance
// sampling are more.
TEST(SeparateModes, HaveTheirShareOfTheDraws) {
  for (const SquaresCase& one : kSquares) {
    const Cost cost = CostOfSquares(one);
    const PosteriorDraws draws =
        DrawPosterior(cost, DesignOfSquares(one), Matrix(0, 2 + one.linear), {}, Stop()).value();
    EXPECT_EQ(WhyNotMixed(draws), "");
    EXPECT_EQ(draws.minima.size(), 4U);
    ExpectSigns(one, draws.scores, draws.weights, 4 * std::sqrt(0.25 / 2000));
  }
}

// Minima on bounds, here those of a² = 2 with −1 ≤ a ≤ 1, have no Gaussian: the particles come from
// tempering. By symmetry each side has half of them.
TEST(SeparateModes, OnBoundsAreLeftToTempering) {
  const int n = 4;
  std::vector<Measurement> measurements{{[](const Vector& xi) { return xi[0] * xi[0]; }, 2, 0.3}};
  for (int j = 1; j < n; ++j) {
    measurements.push_back({[j](const Vector& xi) { return xi[j]; }, 0, 0.1});
  }
  const Cost cost = CostOf(ManyUniforms(n), measurements);
  ExpansionDesign design;
  design.region = Region::WholePrior(n);
  design.lower = Vector::Constant(n, -1);
  design.upper = Vector::Constant(n, 1);
  design.whole_prior = true;
  const GuardedDraws drawn = DrawIfNearlyGaussian(cost, design, Matrix(0, n), 4096, Stop());
  EXPECT_FALSE(drawn.draws.has_value());
  EXPECT_FALSE(drawn.rough.has_value());
  const Particles particles = SampleForReexpansion(cost, design, Matrix(0, n), 1, Stop()).value();
  const auto above = (particles.etas.col(0).array() > 0).count();
  EXPECT_NEAR(static_cast<double>(above), 500, 4 * std::sqrt(500.0));
}

}  // namespace
}  // namespace polyest::internal
