#include "core/bayes/relative_samples.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/bayes/mismatch.h"

namespace polyest::internal::relative_samples_test {
namespace {

constexpr int kTerms = 4, kSamples = 21;
constexpr double kScale = 1.5;

NoiseModel Noise() { return {.absolute = 0.1, .relative = 0.4, .relative_to_max = 0.01}; }

// Samples of which some predictions are near 0, where σ is at its least.
class RelativeSamplesTest : public ::testing::Test {
 protected:
  RelativeSamplesTest() : samples_(true, kTerms) {
    for (int k = 0; k < kSamples; ++k) {
      samples_.Add(coefficients_.col(k), z_[k], predicted_[k],
                   RelativeDeviation::Of(Noise(), largest_[k], kScale), own_error_, reference_);
    }
  }

  double VarianceAt(int k, double y) const {
    const double sigma = kScale * Noise().StandardDeviation(y, largest_[k]);
    return sigma * sigma + own_error_;
  }

  const Matrix coefficients_ = Matrix::Random(kTerms, kSamples);
  const Vector z_ = 2 * Vector::Random(kSamples);
  const Vector predicted_ = Vector::Random(kSamples);
  const Vector largest_ = Vector::LinSpaced(kSamples, 2, 5e3);
  const double own_error_ = 0.02, reference_ = 0.7;
  RelativeSamples samples_;
};

TEST_F(RelativeSamplesTest, HaveTheNoiseOfTheirPredictions) {
  const Matrix points = Matrix::Random(7, kTerms);
  Matrix product;
  Vector chi_squared(7), log_variance(7);
  samples_.EvaluateMany(points, product, chi_squared, log_variance);
  for (int i = 0; i < 7; ++i) {
    const Vector d = points.row(i).transpose();
    double expected = 0, logs = 0;
    for (int k = 0; k < kSamples; ++k) {
      const double y = predicted_[k] + coefficients_.col(k).dot(d);
      expected += (z_[k] - y) * (z_[k] - y) / VarianceAt(k, y);
      logs += std::log(VarianceAt(k, y) / reference_);
    }
    const RelativeSamples::Totals totals = samples_.At(d);
    EXPECT_NEAR(totals.chi_squared, expected, 1e-12 * expected);
    EXPECT_NEAR(totals.log_variance, logs, 1e-12 * kSamples);
    EXPECT_NEAR(chi_squared[i], expected, 1e-12 * expected);
    EXPECT_NEAR(log_variance[i], logs, 1e-12 * kSamples);
  }
}

// With d = Tᵀ d′ + δ the predictions are the same.
TEST_F(RelativeSamplesTest, AreTheSameByOtherTerms) {
  const Matrix t = Matrix::Random(3, kTerms);
  const Vector shift = Vector::Random(kTerms), d = Vector::Random(3);
  const RelativeSamples moved = samples_.Substituted(t, shift);
  EXPECT_EQ(moved.count(), kSamples);
  EXPECT_TRUE(moved.IsValid(3));
  const RelativeSamples::Totals before = samples_.At(t.transpose() * d + shift);
  EXPECT_NEAR(moved.At(d).chi_squared, before.chi_squared, 1e-12 * before.chi_squared);
  EXPECT_NEAR(moved.At(d).log_variance, before.log_variance, 1e-12 * kSamples);
}

TEST(RelativeDeviation, IsThatOfTheNoiseModelWithItsLeast) {
  for (const double least : {0.0, 0.3, 0.05}) {
    NoiseModel noise = Noise();
    noise.least = least;
    const RelativeDeviation deviation = RelativeDeviation::Of(noise, 7, kScale);
    for (const double y : {-3.0, -0.4, 0.0, 1e-5, 0.2, 9.0}) {
      EXPECT_NEAR(deviation.At(y), kScale * noise.StandardDeviation(y, 7), 1e-15) << y;
    }
  }
}

class MismatchOfRelativeNoise : public RelativeSamplesTest,
                                public ::testing::WithParamInterface<bool> {
 protected:
  Mismatch Make() const {
    std::vector<ChannelSums> channels(1, ChannelSums(kTerms));
    // What the sums hold does not count, only how many samples they have.
    for (int k = 0; k < kSamples; ++k) channels[0].samples.Add(coefficients_.col(k), 1, 1);
    channels[0].scale_unknown = GetParam();
    return Mismatch(channels, {}, {samples_});
  }
};

// −log of the Gaussian density of each sample, or that with ∫ s^−N e^{−A/2s²} ds/s over the scale.
TEST_P(MismatchOfRelativeNoise, IsTheLikelihoodUpToAConstant) {
  const Mismatch mismatch = Make();
  const auto lacks = [&](const Vector& d) {
    double logs = 0, chi_squared = 0;
    for (int k = 0; k < kSamples; ++k) {
      const double y = predicted_[k] + coefficients_.col(k).dot(d);
      logs += 0.5 * std::log(VarianceAt(k, y));
      chi_squared += (z_[k] - y) * (z_[k] - y) / VarianceAt(k, y);
    }
    const double of_scale = GetParam() ? 0.5 * kSamples * std::log(chi_squared) : chi_squared / 2;
    return mismatch.Evaluate(d) - logs - of_scale;
  };
  const double constant = lacks(Vector::Zero(kTerms));
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(lacks(Vector::Random(kTerms)), constant, 1e-11);
}

// A central difference of second order with the step h is wrong by about h² and by rounding/h.
TEST_P(MismatchOfRelativeNoise, HasTheGradientAndCurvatureOfCentralDifferences) {
  constexpr double kStep = 1e-5;
  const Mismatch mismatch = Make();
  const Vector d = Vector::Random(kTerms);
  Vector gradient(kTerms), above(kTerms), below(kTerms);
  EXPECT_NEAR(mismatch.EvaluateWithGradient(d, gradient), mismatch.Evaluate(d), 1e-11);
  const Matrix curvature = mismatch.Curvature(d, Matrix::Identity(kTerms, kTerms));
  for (int i = 0; i < kTerms; ++i) {
    const Vector step = kStep * Vector::Unit(kTerms, i);
    const double slope = (mismatch.EvaluateWithGradient(d + step, above) -
                          mismatch.EvaluateWithGradient(d - step, below)) /
                         (2 * kStep);
    EXPECT_NEAR(gradient[i], slope, 1e-6 * gradient.norm());
    EXPECT_LT((curvature.col(i) - (above - below) / (2 * kStep)).norm(), 1e-6 * curvature.norm());
  }
}

INSTANTIATE_TEST_SUITE_P(OfKnownAndUnknownSize, MismatchOfRelativeNoise, ::testing::Bool());

}  // namespace
}  // namespace polyest::internal::relative_samples_test
