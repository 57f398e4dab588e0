// The exact-model correction. The draws are a lattice of a standard normal distribution in the
// plane, so that the corrected posterior is the Gaussian that completing the square gives.

#include "core/estimator/posterior/model_correction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/bayes/weighted_samples.h"
#include "core/chaos/collocation_points.h"
#include "core/chaos/germ.h"

namespace polyest::internal {
namespace {

constexpr int kDraws = 4096;
constexpr int kChecks = 60;

// Returns the points of a sequence of low discrepancy from `first` on, as draws of the normal
// distribution.
Matrix NormalPoints(int first, int count) {
  const Matrix unit = UnitCubePoints(PointSet::kHalton, 2, first + count).bottomRows(count);
  return unit.unaryExpr([](double p) { return Germ::Normal().Quantile(p); });
}

struct Corrected {
  ModelCorrection correction;
  Vector mean = Vector(2), std_dev = Vector(2);
};

// Corrects the draws by ΔJ, known at check points that are draws as well.
Corrected CorrectBy(const std::function<double(double x, double y)>& difference) {
  const Matrix draws = NormalPoints(1000, kDraws);
  Vector weights = Vector::Constant(kDraws, 1.0 / kDraws);
  CheckDifferences checks;
  checks.etas = NormalPoints(10, kChecks);
  checks.log_weights = Vector::Constant(kChecks, -3);
  checks.differences.resize(kChecks);
  for (int i = 0; i < kChecks; ++i) {
    checks.differences[i] = difference(checks.etas(i, 0), checks.etas(i, 1));
  }
  checks.residuals = Vector::Zero(kChecks);
  Corrected result;
  result.correction = CorrectByModel(checks, draws, weights, /*largest_shift=*/1);
  if (result.correction.degree > 0) {
    weights.array() *= result.correction.log_factors.array().exp();
    weights /= weights.sum();
  }
  for (int i = 0; i < 2; ++i) {
    result.mean[i] = WeightedMean(draws.col(i), weights);
    result.std_dev[i] = WeightedStandardDeviation(draws.col(i), weights);
  }
  return result;
}

// e^{−x²/2 − b x} has its mean at −b.
TEST(ModelCorrection, MovesTheMeanByALinearDifference) {
  const Corrected corrected = CorrectBy([](double x, double y) { return 7 + 0.5 * x - 0.2 * y; });
  EXPECT_EQ(corrected.correction.degree, 1);
  EXPECT_NEAR(corrected.mean[0], -0.5, 0.01);
  EXPECT_NEAR(corrected.mean[1], 0.2, 0.01);
  EXPECT_NEAR(corrected.std_dev[0], 1, 0.02);
  EXPECT_LT(corrected.correction.shift, 1e-6);
}

// e^{−x²/2 − c x²} has the variance 1/(1 + 2c).
TEST(ModelCorrection, ChangesTheSpreadByAQuadraticDifference) {
  const Corrected corrected = CorrectBy([](double x, double) { return 0.3 * x * x; });
  EXPECT_EQ(corrected.correction.degree, 2);
  EXPECT_NEAR(corrected.std_dev[0], 1 / std::sqrt(1.6), 0.01);
  EXPECT_NEAR(corrected.std_dev[1], 1, 0.02);
  EXPECT_LT(corrected.correction.shift, 1e-6);
}

// What the polynomial cannot follow stays as the bound on the error.
TEST(ModelCorrection, ReportsWhatIsLeft) {
  const Corrected corrected =
      CorrectBy([](double x, double y) { return x + 0.1 * std::sin(20 * x + 30 * y); });
  EXPECT_EQ(corrected.correction.degree, 1);
  // The root mean square of 0.1 sin is 0.07; the linear fit adds 3 terms of 60 points.
  EXPECT_NEAR(corrected.correction.shift, 0.07, 0.02);
}

// A difference without a trend is no reason to move the posterior.
TEST(ModelCorrection, LeavesScatterAlone) {
  const Corrected corrected =
      CorrectBy([](double x, double y) { return 0.3 * std::sin(200 * x + 300 * y); });
  EXPECT_EQ(corrected.correction.degree, 0);
  EXPECT_EQ(corrected.correction.log_factors.size(), 0);
}

// Weights e^{c x²} of draws of a normal distribution have a tail of shape 2c.
TEST(ModelCorrection, ReportsTheTailOfTheWeights) {
  const Corrected mild = CorrectBy([](double x, double) { return 0.1 * x; });
  const Corrected wild = CorrectBy([](double x, double) { return -1.5 * x * x; });
  ASSERT_TRUE(mild.correction.pareto_shape);
  ASSERT_TRUE(wild.correction.pareto_shape);
  EXPECT_LT(*mild.correction.pareto_shape, 0.5);
  EXPECT_GT(*wild.correction.pareto_shape, 0.7);
}

// Weights e^{c x²} make a posterior of normal draws that these no longer represent. They tell
// nothing of the model then, and need not where the expansion follows it everywhere.
TEST(ModelCorrection, LeavesOutTheTailOfDrawsLeftBehindByAnExactExpansion) {
  CheckDifferences checks;
  checks.etas = NormalPoints(10, 60);
  checks.log_weights = 1.5 * checks.etas.col(0).cwiseAbs2();
  checks.differences = Vector::Zero(60);
  checks.residuals = Vector::Zero(60);
  const Matrix draws = NormalPoints(1000, 100);
  const Vector weights = Vector::Constant(100, 1.0 / 100);
  const auto shape = CorrectByModel(checks, draws, weights, /*largest_shift=*/0.02).pareto_shape;
  ASSERT_TRUE(shape);
  EXPECT_GT(*shape, 0.7);
  EXPECT_EQ(CorrectByModel(checks, draws, weights, 0.005).pareto_shape, std::nullopt);
  // An error that is not known is not small.
  EXPECT_TRUE(CorrectByModel(checks, draws, weights, std::nan("")).pareto_shape);
  // Draws that still represent the posterior are told of, whatever the expansion.
  checks.log_weights = 0.1 * checks.etas.col(0);
  EXPECT_TRUE(CorrectByModel(checks, draws, weights, 0.005).pareto_shape);
}

TEST(ModelCorrection, NeedsChecksForEachTerm) {
  CheckDifferences checks;
  checks.etas = NormalPoints(10, 5);
  checks.log_weights = Vector::Zero(5);
  checks.differences = checks.etas.col(0);
  checks.residuals = Vector::Zero(5);
  const Matrix draws = NormalPoints(1000, 100);
  const ModelCorrection correction =
      CorrectByModel(checks, draws, Vector::Constant(100, 1.0 / 100), /*largest_shift=*/1);
  EXPECT_EQ(correction.degree, 0);
  EXPECT_EQ(correction.pareto_shape, std::nullopt);
}

}  // namespace
}  // namespace polyest::internal
