// Residuals that contradict the stated noise: with flat priors the minimum must not depend on it.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/testing/oscillator.h"
#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/estimator/text_problem.h"

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

// The gradient of a cost over v² vanishes at v = 0, the prior's mean, where the residuals are
// large.
TEST(Misfit, IsNotSeenAtAStationaryPointThatIsNoMinimum) {
  const auto estimator =
      Processed(TextProblem("v^2", {*UncertainParameter::Uniform("v", -3, 3)}, 0.05),
                {1.02, 0.97, 1.01, 0.99});
  const ParameterEstimate v = estimator->CurrentEstimate().value().parameters[0];
  EXPECT_NEAR(std::abs(v.map), 1, 0.02);
  EXPECT_NEAR(v.std_dev, 0.05 / std::sqrt(4) / 2, 0.001);  // σ ÷ √N ÷ |∂(v²)/∂v|
  EXPECT_NEAR(v.mean, 0, 0.05);                            // of both signs
}

}  // namespace
}  // namespace polyest::internal
