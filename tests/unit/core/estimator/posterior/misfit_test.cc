// Residuals that contradict the stated noise: with flat priors the minimum must not depend on it.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/testing/oscillator.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

Estimate WithNoise(const Samples& record, double noise) {
  Problem problem = testing::OscillatorProblem(3);
  problem.measured.front().noise = {.absolute = noise};
  return EstimateOf(problem, record);
}

// The oracle is least squares, whose answer knows nothing of the noise.
TEST(Misfit, DoesNotMoveTheMinimum) {
  testing::OscillatorTruth truth;
  const Samples record = testing::OscillatorRecord(30, 5, truth);
  const testing::LeastSquares exact = testing::FitOscillator(record, truth);
  for (const double factor : {0.03, 0.1, 0.3, 1.0, 3.0}) {
    const Estimate estimate = WithNoise(record, factor * testing::kOscillatorNoise);
    const ParameterEstimate& k = estimate.parameters[0];
    const ParameterEstimate& c = estimate.parameters[1];
    EXPECT_NEAR(k.map, exact.k, 0.15 * exact.k_std_dev) << factor;
    EXPECT_NEAR(c.map, exact.c, 0.15 * exact.c_std_dev) << factor;
    EXPECT_EQ(Has(estimate, DiagnosticCode::kModelMisfit), factor != 1) << factor;
  }
}

// With noise stated too small, the uncertainty is that of the residuals.
TEST(Misfit, WidensTheUncertaintyToTheResiduals) {
  testing::OscillatorTruth truth;
  const Samples record = testing::OscillatorRecord(30, 5, truth);
  const Estimate right = WithNoise(record, testing::kOscillatorNoise);
  const Estimate small = WithNoise(record, 0.1 * testing::kOscillatorNoise);
  for (size_t i = 0; i < 2; ++i) {
    const double ratio =
        small.parameters[i].posterior_std_dev / right.parameters[i].posterior_std_dev;
    EXPECT_GT(ratio, 0.8);
    EXPECT_LT(ratio, 2);
  }
}

}  // namespace
}  // namespace polyest::internal
