// Tests the prior of runs that share a population. The oracles are quadrature and differences.

#include "core/bayes/population_cost.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/chaos/gauss_rule.h"

namespace polyest::internal {
namespace {

double LogNormal(double x, double mean, double variance) {
  return -0.5 * (x - mean) * (x - mean) / variance - 0.5 * std::log(variance);
}

// The germs are μ's, the spread's and a shared one, on which the second run's score depends.
PopulationCost TwoRuns(double first, double second) {
  Matrix slope = Matrix::Zero(2, 3);
  slope(1, 2) = 0.3;
  return PopulationCost(0, 1, Vector{{0.4, -0.7}}, slope, Vector{{first, second}});
}

// Returns what a run adds, by the trapezoidal rule over 12 standard deviations of N(c, S), which is
// exact to rounding for a Gaussian, and the score's posterior there.
struct Quadrature {
  double cost = 0;
  RunScore score;
  Quadrature(double c, double S, const RunScore& population) {
    constexpr int kNodes = 2001;
    double sum = 0, first = 0, second = 0;
    for (int i = 0; i < kNodes; ++i) {
      const double u = 24.0 * (i / (kNodes - 1.0) - 0.5), g = c + u * std::sqrt(S);
      const double density =
          std::exp(-0.5 * u * u + LogNormal(g, population.mean, population.variance) -
                   LogNormal(g, 0, 1)) *
          24 / (kNodes - 1) / std::sqrt(2 * std::acos(-1));
      sum += density;
      first += density * g;
      second += density * g * g;
    }
    cost = -std::log(sum);
    score = {first / sum, second / sum - first * first / sum / sum};
  }
};

// Compares with central differences. Their error in the gradient is kStep²/6 of the third
// derivative, which is about 10 for Gaussians; that in the Hessian may be ten times as large.
void ExpectDerivatives(const PopulationCost& cost, const Vector& xi, double error) {
  constexpr double kStep = 1e-4;
  const auto exact = cost.Differentiate(xi);
  EXPECT_NEAR(exact.value, cost.Evaluate(xi), 1e-12);
  for (Eigen::Index i = 0; i < xi.size(); ++i) {
    Vector above = xi, below = xi;
    above[i] += kStep;
    below[i] -= kStep;
    EXPECT_NEAR(exact.gradient[i], (cost.Evaluate(above) - cost.Evaluate(below)) / 2 / kStep,
                error);
    const Vector change =
        (cost.Differentiate(above).gradient - cost.Differentiate(below).gradient) / 2 / kStep;
    EXPECT_LT((exact.hessian.col(i) - change).cwiseAbs().maxCoeff(), 10 * error);
  }
  EXPECT_LT((exact.hessian - exact.hessian.transpose()).cwiseAbs().maxCoeff(), 1e-12);
}

// The second of two runs has not ended; the power is that of the first one's likelihood.
TEST(PopulationCost, HasThePowerOfTheLikelihoodOfEndedRuns) {
  const Vector xi{{0.3, -0.8, 1.2}};
  const auto ended = [&](int runs) {
    return PopulationCost(0, 1, Vector::Constant(runs, 0.4), Matrix::Zero(runs, 3),
                          Vector::Constant(runs, 0.2), {ScoreMixture()});
  };
  const double one = ended(1).Evaluate(xi);
  EXPECT_NEAR(ended(1).Evaluate(xi, 0.3), 0.3 * one, 1e-12);
  EXPECT_NEAR(ended(2).Evaluate(xi, 0.3), 1.3 * one, 1e-12);
  const auto whole = ended(1).Differentiate(xi), tempered = ended(2).Differentiate(xi, 0.3);
  EXPECT_NEAR(tempered.value, 1.3 * whole.value, 1e-12);
  EXPECT_LT((tempered.gradient - 1.3 * whole.gradient).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((tempered.hessian - 1.3 * whole.hessian).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(PopulationCost, IsTheIntegralOverTheRuns) {
  for (const double variance : {1e-4, 0.1, 0.6, 1.0}) {
    const Vector xi{{0.3, -0.8, 1.2}};
    const PopulationCost cost = TwoRuns(variance, 0.2);
    const RunScore population = cost.PopulationAt(xi);
    EXPECT_DOUBLE_EQ(population.mean, 0.3);
    EXPECT_DOUBLE_EQ(std::sqrt(population.variance), 0.5 * std::exp(-0.8));
    const Quadrature first(0.4, variance, population), second(-0.7 + 0.3 * 1.2, 0.2, population);
    EXPECT_NEAR(cost.Evaluate(xi), first.cost + second.cost, 1e-9) << variance;
    const RunScore score = InPopulation({0.4, variance}, population);
    EXPECT_NEAR(score.mean, first.score.mean, 1e-9);
    EXPECT_NEAR(score.variance, first.score.variance, 1e-9);
  }
}

// A run that is still expanded: its score is a germ.
TEST(PopulationCost, OfAKnownScoreIsTheRatioOfTheDensities) {
  const PopulationCost cost = TwoRuns(0, 0);
  const Vector xi{{0.3, 0.8, 1.2}};
  const RunScore population = cost.PopulationAt(xi);
  double expected = 0;
  for (const double g : {0.4, -0.7 + 0.3 * 1.2}) {
    expected += LogNormal(g, 0, 1) - LogNormal(g, population.mean, population.variance);
  }
  EXPECT_NEAR(cost.Evaluate(xi), expected, 1e-12);
}

// A mixture of one component is a Gaussian; that of a skewed run has the derivatives of its
// differences.
TEST(PopulationCost, OfAMixtureHasTheDerivativesOfItsDifferences) {
  const Matrix slope{{0, 0, 0.3}};
  const Vector base = Vector::Constant(1, 0.4), variance = Vector::Constant(1, 0.2);
  const PopulationCost one(0, 1, base, slope, variance, {{0.1, 0.3, Vector::Zero(1)}});
  const PopulationCost gaussian(0, 1, Vector::Constant(1, 0.5), slope, Vector::Constant(1, 0.09));
  const Vector skewed = Vector{{0.05, 0.25, 0.4, 0.2, 0.1}}.array().log();
  const PopulationCost cost(0, 1, base, slope, variance, {{-0.6, 0.3, skewed}});
  for (const double spread : {-6.0, -0.4, 1.5}) {
    const Vector xi{{0.3, spread, 1.2}};
    EXPECT_NEAR(one.Evaluate(xi), gaussian.Evaluate(xi), 1e-12);
    ExpectDerivatives(cost, xi, 1e-5);
  }
}

// The quantiles of a mixture in a population, against those of draws on a fine grid.
TEST(PopulationCost, HasTheQuantilesOfTheRunInThePopulation) {
  const ScoreMixture shape{-0.6, 0.3, Vector{{0.05, 0.25, 0.4, 0.2, 0.1}}.array().log()};
  const RunScore alone{0.4, 0.2}, population{-0.2, 0.25};
  const double probability = 0.9;
  const double quantile = QuantileInPopulation(alone, shape, population, probability);
  double below = 0, all = 0;
  for (int i = -50'000; i <= 50'000; ++i) {
    const double g = 1e-4 * i;
    double density = 0;
    for (int k = 0; k < 5; ++k) {
      density += std::exp(shape.log_weights[k] + LogNormal(g, 0.4 - 0.6 + 0.3 * k, 0.09));
    }
    density *= std::exp(LogNormal(g, population.mean, population.variance) - LogNormal(g, 0, 1));
    all += density;
    if (g < quantile) below += density;
  }
  EXPECT_NEAR(below / all, probability, 1e-4);
  // Of a Gaussian: mean ± 1 standard deviation.
  const RunScore with = InPopulation(alone, population);
  EXPECT_NEAR(QuantileInPopulation(alone, {}, population, 0.8413447460685429),
              with.mean + std::sqrt(with.variance), 1e-9);
}

TEST(PopulationCost, HasTheDerivativesOfItsDifferences) {
  for (const double variance : {0.0, 0.3, 1.0}) {
    const PopulationCost cost = TwoRuns(variance, 0.2);
    const Vector xi{{0.3, -0.4, 1.2}};
    ExpectDerivatives(cost, xi, 1e-6);
    const auto exact = cost.Differentiate(xi);
    EXPECT_DOUBLE_EQ(exact.value, cost.Evaluate(xi));
    EXPECT_EQ(exact.hessian, Matrix(exact.hessian.transpose()));
  }
}

}  // namespace
}  // namespace polyest::internal
