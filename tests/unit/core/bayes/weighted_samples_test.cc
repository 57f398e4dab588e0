#include "core/bayes/weighted_samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;

const Eigen::Vector4d kDraws(4, 1, 3, 2);
const Eigen::Vector4d kWeights(0.1, 0.4, 0.2, 0.3);

TEST(WeightedSamples, HaveTheMomentsOfTheirWeights) {
  EXPECT_NEAR(WeightedMean(kDraws, kWeights), 2, 1e-15);
  // The variance is 0.1·4 + 0.4·1 + 0.2·1 + 0.3·0.
  EXPECT_NEAR(WeightedStandardDeviation(kDraws, kWeights), 1, 1e-15);
}

// The cumulative probabilities at the draws 1, 2, 3, 4 are 0.2, 0.55, 0.8, 0.95.
TEST(WeightedQuantiles, RunLinearlyBetweenDraws) {
  const WeightedQuantiles quantile(kDraws, kWeights);
  EXPECT_NEAR(quantile(0.2), 1, 1e-12);
  EXPECT_NEAR(quantile(0.375), 1.5, 1e-12);
  EXPECT_NEAR(quantile(0.8), 3, 1e-12);
  EXPECT_EQ(quantile(0), 1);
  EXPECT_EQ(quantile(0.99), 4);
}

// Among draws that crowd in one place, are equal or farther apart than a number can be, too.
TEST(WeightedQuantiles, AreThoseOfDrawsInAscendingOrder) {
  constexpr int kCount = 1000;
  const Vector uniform = Vector::Random(kCount);
  const Vector weights = Vector::LinSpaced(kCount, 1, 2) / (1.5 * kCount);
  const Vector tailed = uniform.array() / (1.001 - uniform.array().square()).cube();
  Vector apart = uniform;
  apart[17] = -1.5e308;
  apart[18] = 1.5e308;
  const Vector rounded = (4 * uniform).array().round();
  for (const Vector& draws : {uniform, tailed, rounded, apart}) {
    std::vector<std::pair<double, double>> sorted(kCount);
    for (size_t i = 0; i < kCount; ++i) {
      sorted[i] = {draws[static_cast<Eigen::Index>(i)], weights[static_cast<Eigen::Index>(i)]};
    }
    std::sort(sorted.begin(), sorted.end());
    const WeightedQuantiles quantile(draws, weights);
    double below = 0;
    for (size_t i = 0; i < kCount; ++i) {
      const auto [draw, weight] = sorted[i];
      // Next to a draw that is far away, rounding of the probability matters.
      if (i > 1 && i < kCount - 2) {
        EXPECT_NEAR(quantile(below + weight / 2), draw, 1e-9 * std::max(1.0, std::abs(draw)));
      }
      below += weight;
    }
  }
}

TEST(WeightedDensity, HoldsTheProbabilityOfItsBins) {
  const int count = 10'000;
  // The density is 2x on [0, 1].
  const Vector draws = Vector::LinSpaced(count, 0, 1).array().sqrt();
  const Vector weights = Vector::Constant(count, 1.0 / count);
  const DensityEstimate density = WeightedDensity(draws, weights, 20);
  ASSERT_EQ(density.value.size(), 20);
  const double width = density.value[1] - density.value[0];
  EXPECT_NEAR(density.density.sum() * width, 0.999, 2e-4);
  for (int i = 0; i < 20; ++i) {
    // A bin holds whole draws: one more or less of 10⁴.
    EXPECT_NEAR(density.density[i], 2 * density.value[i], 2 * 1e-4 / width);
  }
}

TEST(WeightedDensity, OfDrawsThatDoNotVaryIsOneBin) {
  const DensityEstimate density =
      WeightedDensity(Vector::Constant(5, 3), Vector::Constant(5, 0.2), 10);
  ASSERT_EQ(density.value.size(), 1);
  EXPECT_EQ(density.value[0], 3);
  EXPECT_NEAR(density.density[0], 1, 1e-12);
}

TEST(WeightedJointDensity, OfIndependentDrawsIsTheProductOfTheMarginals) {
  const int side = 300;
  Vector first(side * side), second(side * side);
  for (int i = 0; i < side * side; ++i) {
    first[i] = (i % side + 0.5) / side;
    second[i] = 10 * (i / side + 0.5) / side;
  }
  const Vector weights = Vector::Constant(side * side, 1.0 / (side * side));
  const JointDensity joint = WeightedJointDensity(first, second, weights, 5);
  ASSERT_EQ(joint.density.rows(), 5);
  ASSERT_EQ(joint.density.cols(), 5);
  // The density is uniform on [0, 1] × [0, 10]; a bin holds 60 ± 1 draws a side.
  EXPECT_NEAR(joint.density.minCoeff(), 0.1, 0.004);
  EXPECT_NEAR(joint.density.maxCoeff(), 0.1, 0.004);
  EXPECT_NEAR(joint.second[4], 9, 0.02);
}

TEST(EquallyWeighted, TakesEachDrawAsOftenAsItsWeightSays) {
  EXPECT_THAT(EquallyWeighted(kWeights, 10), ElementsAre(0, 1, 1, 1, 1, 2, 2, 3, 3, 3));
  EXPECT_TRUE(EquallyWeighted(kWeights, 0).empty());
  EXPECT_EQ(StratifiedDraws(kWeights, 10), EquallyWeighted(kWeights, 10));
}

// The radical inverse of a number in a base: the points of Halton's sequence in one dimension.
double RadicalInverse(int number, int base) {
  double inverse = 0;
  for (double unit = 1.0 / base; number > 0; number /= base, unit /= base) {
    inverse += unit * (number % base);
  }
  return inverse;
}

// Draws at a stride that is a power of the base are all in one layer. As many random draws have the
// mean of a uniform variable to √(1/12/count), and its standard deviation to √(1/60/count).
TEST(StratifiedDraws, AreNotInStepWithALowDiscrepancySequence) {
  constexpr int kLength = 6 * 6 * 6 * 25;
  const Vector weights = Vector::Constant(kLength, 1.0 / kLength);
  for (const int base : {2, 3, 5}) {
    for (const int count : {100, 200, 216, 300, 400, 600, 675}) {
      Vector chosen(count);
      int i = 0;
      for (const Eigen::Index row : StratifiedDraws(weights, count)) {
        chosen[i++] = RadicalInverse(static_cast<int>(row), base);
      }
      const double deviation = std::sqrt((chosen.array() - chosen.mean()).square().mean());
      EXPECT_NEAR(chosen.mean(), 0.5, 3 * std::sqrt(1.0 / 12 / count)) << base << ' ' << count;
      EXPECT_NEAR(deviation, std::sqrt(1.0 / 12), 3 * std::sqrt(1.0 / 60 / count))
          << base << ' ' << count;
    }
  }
}

}  // namespace
}  // namespace polyest::internal
