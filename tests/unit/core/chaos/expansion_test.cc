#include "core/chaos/expansion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

namespace polyest::internal {
namespace {

TEST(Expansion, MomentsAreThoseOfTheCoefficients) {
  // The first output, ξ² of a standard normal, is 1 + √2 φ_2: mean 1, variance 2. The second is
  // constant.
  const auto basis = std::make_shared<Basis>(std::vector<Germ>{Germ::Normal()}, 2);
  Matrix coefficients = Matrix::Zero(3, 2);
  coefficients.col(0) << 1, 0, std::sqrt(2);
  coefficients(0, 1) = -4;
  const Expansion expansion(basis, coefficients);
  EXPECT_NEAR(expansion.Mean()[0], 1, 1e-15);
  EXPECT_NEAR(expansion.StandardDeviation()[0], std::sqrt(2), 1e-15);
  EXPECT_EQ(expansion.Mean()[1], -4);
  EXPECT_EQ(expansion.StandardDeviation()[1], 0);
  for (const double xi : {-2.0, 0.0, 0.7}) {
    EXPECT_NEAR(expansion.Evaluate(Vector::Constant(1, xi))[0], xi * xi, 1e-14);
  }
}

TEST(Expansion, OfOrderZeroDoesNotVary) {
  const auto basis = std::make_shared<Basis>(std::vector<Germ>{Germ::Gamma(2)}, 0);
  const Expansion expansion(basis, Matrix::Constant(1, 1, 3));
  EXPECT_EQ(expansion.Mean()[0], 3);
  EXPECT_EQ(expansion.StandardDeviation()[0], 0);
  EXPECT_TRUE((expansion.Sample(10).array() == 3).all());
}

TEST(Expansion, SamplesHaveTheMomentsOfTheExpansion) {
  const auto basis = std::make_shared<Basis>(
      std::vector<Germ>{Germ::Uniform(), Germ::Beta(2, 2), Germ::Uniform()}, 2);
  Matrix coefficients(basis->size(), 1);
  coefficients << 2, 1, -0.5, 0.25, 0.1, 0.2, -0.3, 0.05, 0.1, -0.1;
  const Expansion expansion(basis, coefficients);
  const Matrix samples = expansion.Sample(4000);
  ASSERT_EQ(samples.rows(), 4000);
  const double mean = samples.mean();
  const double deviation = std::sqrt((samples.array() - mean).square().mean());
  // Independent draws would err by 1.2/√4000 = 0.02; Halton's error is of order log³N / N.
  EXPECT_NEAR(mean, 2, 3e-3);
  EXPECT_NEAR(deviation, expansion.StandardDeviation()[0], 5e-3);
  EXPECT_EQ(samples, expansion.Sample(4000));
}

TEST(DensityOfSamples, IsANormalizedHistogram) {
  const DensityEstimate estimate = DensityOfSamples(Vector{{0, 0.5, 1, 1.5, 3.9, 4}}, 4);
  EXPECT_TRUE(estimate.value.isApprox(Vector{{0.5, 1.5, 2.5, 3.5}}, 1e-15));
  EXPECT_TRUE(estimate.density.isApprox(Vector{{2, 2, 0, 2}} / 6, 1e-15));
}

TEST(DensityOfSamples, PutsSamplesThatDoNotVaryIntoOneBin) {
  const DensityEstimate estimate = DensityOfSamples(Vector::Constant(5, 2.5), 10);
  ASSERT_EQ(estimate.value.size(), 1);
  EXPECT_EQ(estimate.value[0], 2.5);
  EXPECT_EQ(estimate.density[0], 1);
}

TEST(QuantileOfSorted, InterpolatesTheOrderStatistics) {
  const Vector samples{{1, 2, 3, 5}};
  EXPECT_EQ(QuantileOfSorted(samples, 0), 1);
  EXPECT_EQ(QuantileOfSorted(samples, 1), 5);
  EXPECT_EQ(QuantileOfSorted(samples, 0.5), 2.5);
  EXPECT_NEAR(QuantileOfSorted(samples, 0.9), 3 + 0.7 * 2, 1e-14);  // at position 2.7
  EXPECT_EQ(QuantileOfSorted(Vector::Constant(1, 7), 0.3), 7);
}

}  // namespace
}  // namespace polyest::internal
