#include "core/bayes/mixture_importance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "core/bayes/weighted_samples.h"
#include "tests/unit/core/bayes/many_parameters.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal {
namespace {

// Measures a² + s a = 1 with noise 0.1 and, of three other unknowns, the first and the sum.
Cost TwoModes(double s) {
  return CostOf(ManyNormals(4),
                {{[s](const Vector& xi) { return xi[0] * xi[0] + s * xi[0]; }, 1, 0.1},
                 {[](const Vector& xi) { return xi[1]; }, 0.5, 0.3},
                 {[](const Vector& xi) { return xi[1] + xi[2] + xi[3]; }, 0.2, 0.1}});
}

// Returns the posterior mean of a by quadrature in steps of 10⁻³ standard deviations of the prior.
double MeanOfA(double s) {
  double sum = 0, mean = 0;
  for (double a = -6; a < 6; a += 1e-3) {
    const double density = std::exp(-0.5 * (std::pow((a * a + s * a - 1) / 0.1, 2) + a * a));
    sum += density;
    mean += a * density;
  }
  return mean / sum;
}

// Returns the modes that Newton's method finds from the roots of a² + s a = 1.
std::vector<GaussianMode> ModesOf(const Cost& cost, double s) {
  std::vector<GaussianMode> modes;
  for (const double side : {1.0, -1.0}) {
    Vector eta = Vector::Zero(4), gradient(4);
    eta[0] = (side * std::sqrt(s * s + 4) - s) / 2;
    for (int i = 0; i < 20; ++i) {
      cost.EvaluateWithGradient(eta, gradient);
      eta -= cost.Hessian(eta).llt().solve(gradient);
    }
    const Matrix factor = Eigen::LLT<Matrix>(cost.Hessian(eta)).matrixL();
    modes.push_back(ModeAt(eta, cost.Evaluate(eta).total, factor));
  }
  return modes;
}

WeightedDraws DrawFrom(const Cost& cost, const std::vector<GaussianMode>& modes, int points) {
  const Eigen::Index n = cost.dimension();
  return ImportanceSample(cost, Vector::Constant(n, -20), Vector::Constant(n, 20), modes, points);
}

// Four standard errors of as many random draws as the effective size; the standard deviation of a
// is 1.
TEST(MixtureImportance, WeighsTheModes) {
  for (const double s : {0.0, 0.1, 0.5, 1.5}) {
    const Cost cost = TwoModes(s);
    const WeightedDraws draws = DrawFrom(cost, ModesOf(cost, s), 16'384);
    EXPECT_GT(draws.effective_size, 0.5 * 16'384) << s;
    EXPECT_NEAR(WeightedMean(draws.etas.col(0), draws.weights), MeanOfA(s),
                4 / std::sqrt(draws.effective_size))
        << s;
  }
}

// The result does not depend on the shares with which the points are dealt, since each mode has
// some of them in any case.
TEST(MixtureImportance, DoesNotBelieveTheShares) {
  const Cost cost = TwoModes(0.1);
  std::vector<GaussianMode> modes = ModesOf(cost, 0.1);
  modes[0].log_share -= 10;
  const WeightedDraws draws = DrawFrom(cost, modes, 16'384);
  EXPECT_NEAR(WeightedMean(draws.etas.col(0), draws.weights), MeanOfA(0.1),
              4 / std::sqrt(draws.effective_size));
}

// Modes beside their places, of the wrong width and with wrong shares are put right.
TEST(MixtureImportance, AdaptsTheModesToTheDraws) {
  const Cost cost = TwoModes(0.1);
  const std::vector<GaussianMode> right = ModesOf(cost, 0.1);
  std::vector<GaussianMode> modes = right;
  for (GaussianMode& mode : modes) {
    mode.centre[1] += 0.4;
    mode.factor /= 2;
    mode.log_share = 0;
  }
  WeightedDraws draws = DrawFrom(cost, modes, 16'384);
  const double before = draws.effective_size;
  for (int i = 0; i < 3; ++i) {
    modes = AdaptedTo(draws, modes);
    draws = DrawFrom(cost, modes, 16'384);
  }
  EXPECT_GT(draws.effective_size, 3 * before);
  EXPECT_GT(draws.effective_size, 0.5 * 16'384);
  EXPECT_NEAR(modes[0].centre[1], right[0].centre[1], 0.02);
}

// Two modes of equal shares at ±2 e_1 with unit variances: mean 0, variance 1 + 4 along e_1. Those
// of unequal shares ¾ and ¼ but for the tenth that is even: 0.725 and 0.275.
TEST(MixtureImportance, PutsAGaussianAroundAllModes) {
  const Vector e = Vector::Unit(2, 0);
  std::vector<GaussianMode> modes{{2 * e, Matrix::Identity(2, 2), 0},
                                  {-2 * e, Matrix::Identity(2, 2), 0}};
  GaussianMode around = AroundAll(modes);
  EXPECT_NEAR(around.centre.norm(), 0, 1e-12);
  EXPECT_NEAR(around.factor(0, 0), 1 / std::sqrt(5.0), 1e-12);
  EXPECT_NEAR(around.factor(1, 1), 1, 1e-12);
  modes[0].log_share = std::log(3.0);
  around = AroundAll(modes);
  EXPECT_NEAR(around.centre[0], 2 * (0.725 - 0.275), 1e-12);
}

// Nothing has a density outside of the box.
TEST(MixtureImportance, HasNoDrawsWhereThereIsNoDensity) {
  const Cost cost = TwoModes(0);
  const WeightedDraws draws = ImportanceSample(cost, Vector::Constant(4, 100),
                                               Vector::Constant(4, 101), ModesOf(cost, 0), 1000);
  EXPECT_EQ(draws.effective_size, 0);
  EXPECT_EQ(draws.etas.rows(), 0);
}

}  // namespace
}  // namespace polyest::internal
