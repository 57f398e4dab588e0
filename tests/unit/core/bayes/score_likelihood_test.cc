// Tests what a population is told of a run: the mixture that stands for its posterior. The oracle
// is quadrature with the likelihood itself.

#include "core/bayes/score_likelihood.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace polyest::internal {
namespace {

// The likelihood of samples of e^g whose mean is `mean`, known to a standard deviation.
double LogLikelihood(double g, double mean, double deviation) {
  const double z = (mean - std::exp(g)) / deviation;
  return -0.5 * z * z;
}

// Returns the likelihood on 51 nodes over ± 4 standard deviations of its posterior, as an ended run
// gives it.
ScoreLikelihood Tabulated(double mean, double deviation) {
  RunScore about{std::log(mean), std::pow(std::min(1.0, deviation / mean), 2)};
  for (int i = 0;; ++i) {
    const double half = 4 * std::sqrt(about.variance);
    const Vector nodes = Vector::LinSpaced(51, about.mean - half, about.mean + half);
    const ScoreLikelihood likelihood(nodes[0], nodes[1] - nodes[0], nodes.unaryExpr([&](double g) {
      return LogLikelihood(g, mean, deviation);
    }));
    if (i == 3) return likelihood;
    about = likelihood.posterior();
  }
}

// Returns −log of ∫ L(g) N(g; population) dg over that in N(0, 1), by the trapezoidal rule.
double Exact(double mean, double deviation, const RunScore& population) {
  const double s = std::sqrt(population.variance);
  double in_population = 0, alone = 0;
  for (int i = -20'000; i <= 8'000; ++i) {
    const double g = 4e-4 * i;
    const double likelihood = std::exp(LogLikelihood(g, mean, deviation));
    const double z = (g - population.mean) / s;
    in_population += likelihood * std::exp(-0.5 * z * z) / s;
    alone += likelihood * std::exp(-0.5 * g * g);
  }
  return -std::log(in_population / alone);
}

double Told(const ScoreLikelihood& likelihood, const RunScore& population) {
  const double spread = std::log(std::sqrt(population.variance) / PopulationCost::kMedianSpread);
  const PopulationCost cost(
      0, 1, Vector::Constant(1, likelihood.posterior().mean), Matrix::Zero(1, 2),
      Vector::Constant(1, likelihood.posterior().variance), {likelihood.Mixture()});
  return cost.Evaluate(Vector{{population.mean, spread}});
}

TEST(ScoreLikelihood, OfAGaussianNeedsNoMixture) {
  const Vector nodes = Vector::LinSpaced(51, -3.0, 3.4);
  const ScoreLikelihood likelihood(nodes[0], nodes[1] - nodes[0], nodes.unaryExpr([](double g) {
    return -0.5 * (g - 0.5) * (g - 0.5) / 0.25;
  }));
  // N(0.5, 0.25) times N(0, 1).
  EXPECT_NEAR(likelihood.posterior().mean, 0.4, 1e-9);
  EXPECT_NEAR(likelihood.posterior().variance, 0.2, 1e-9);
  EXPECT_EQ(likelihood.Mixture().log_weights.size(), 0);
  // −log N(0.5; 0.1, 0.25 + 0.09), without the 1/√(2π 0.25) of a density.
  EXPECT_NEAR(likelihood.NegativeLogEvidence({0.1, 0.09}),
              0.5 * 0.16 / 0.34 + 0.5 * std::log(0.34 / 0.25), 1e-9);
}

// From runs that tell nearly everything to such whose likelihood goes on for ever on one side, in
// populations from a tenth of the prior's width to nearly all of it.
TEST(ScoreLikelihood, IsToldAsItIs) {
  for (const double deviation : {0.01, 0.1, 0.4, 1.0}) {
    for (const double mean : {0.3, 1.2, 2.5}) {
      const ScoreLikelihood likelihood = Tabulated(mean, deviation);
      const double middle = likelihood.posterior().mean;
      const double width = std::sqrt(likelihood.posterior().variance);
      for (const double s : {0.1, 0.3, 0.8}) {
        for (const double z : {-1.5, 0.0, 1.5}) {
          const RunScore population{middle + z * std::hypot(s, width), s * s};
          EXPECT_NEAR(Told(likelihood, population), Exact(mean, deviation, population), 0.03)
              << deviation << ' ' << mean << ' ' << s << ' ' << z;
        }
      }
    }
  }
}

// A Gaussian of the same mean and variance is wrong there by more than what is tolerated above.
TEST(ScoreLikelihood, IsNotToldByMomentsAlone) {
  const ScoreLikelihood likelihood = Tabulated(0.3, 0.4);
  const RunScore population{0, 0.04};
  const PopulationCost moments(0, 1, Vector::Constant(1, likelihood.posterior().mean),
                               Matrix::Zero(1, 2),
                               Vector::Constant(1, likelihood.posterior().variance));
  EXPECT_GT(
      std::abs(moments.Evaluate(Vector{{0, std::log(0.2 / 0.5)}}) - Exact(0.3, 0.4, population)),
      0.05);
}

TEST(ScoreLikelihood, CountsNodesThatVanishAsImprobable) {
  Vector log_likelihood = Vector::Zero(9);
  log_likelihood.head(3).setConstant(-kInfinity);
  const ScoreLikelihood likelihood(-4, 1, log_likelihood);
  EXPECT_LT(likelihood.LogAt(-3), likelihood.LogAt(0) - 100);
  EXPECT_TRUE(std::isfinite(likelihood.LogAt(-30)));
  EXPECT_GT(likelihood.posterior().mean, 0);
  EXPECT_TRUE(std::isfinite(likelihood.NegativeLogEvidence({-3.5, 0.01})));
}

}  // namespace
}  // namespace polyest::internal
