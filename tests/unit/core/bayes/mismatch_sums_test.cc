#include "core/bayes/mismatch_sums.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace polyest::internal {
namespace {

// Fewer terms than a vector has, as many, and two vectors and a rest.
constexpr int kTermsOfSums[] = {1, 3, 8, 21};

struct SampleToSum {
  Vector coefficients;
  double error = 0, variance = 1;
};

std::vector<SampleToSum> SamplesToSum(int count, int terms) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::vector<SampleToSum> samples;
  for (int k = 0; k < count; ++k) {
    SampleToSum& sample = samples.emplace_back();
    sample.coefficients = Vector::NullaryExpr(terms, [&] { return normal(random); });
    sample.error = normal(random);
    sample.variance = 0.5 + k % 3;
  }
  return samples;
}

MismatchSums SummedUp(const std::vector<SampleToSum>& samples, int terms) {
  MismatchSums sums(terms);
  for (const SampleToSum& s : samples) sums.Add(s.coefficients, s.error, s.variance);
  return sums;
}

// Whole numbers and powers of two are added without rounding.
TEST(WaitingSamples, AreSummedExactlyWhereNothingIsRounded) {
  for (const int terms : kTermsOfSums) {
    MismatchSums sums(terms);
    Matrix g = Matrix::Zero(terms, terms);
    Vector b = Vector::Zero(terms);
    for (int k = 0; k < 19; ++k) {
      const Vector c = Vector::NullaryExpr(terms, [&](Eigen::Index i) { return (3 * i + k) % 7; });
      sums.Add(c, k, 0.25);
      g += 4 * c * c.transpose();
      b += 4 * k * c;
      ASSERT_EQ(sums.count(), k + 1);
    }
    EXPECT_EQ(sums.G(), g) << terms << " terms";
    EXPECT_EQ(sums.b(), b);
    EXPECT_EQ(sums.w(), 4 * 2109);  // Σ k² up to 18 is 2109
  }
}

TEST(WaitingSamples, GiveTheSameBitsWheneverTheSumsAreRead) {
  for (const int terms : kTermsOfSums) {
    const std::vector<SampleToSum> samples = SamplesToSum(45, terms);
    const Matrix at_the_end = SummedUp(samples, terms).G();
    MismatchSums often(terms);
    for (const SampleToSum& s : samples) {
      often.Add(s.coefficients, s.error, s.variance);
      ASSERT_EQ(often.G(), often.G().transpose());
    }
    EXPECT_EQ(often.G(), at_the_end) << terms << " terms";
  }
}

TEST(WaitingSamples, AreCopiedAndAddedWithTheSums) {
  const int terms = 21;
  const std::vector<SampleToSum> samples = SamplesToSum(45, terms);
  const MismatchSums sums = SummedUp({samples.begin(), samples.begin() + 11}, terms);
  const MismatchSums copy = sums;
  EXPECT_EQ(copy.G(), sums.G());

  MismatchSums more = SummedUp({samples.begin() + 11, samples.end()}, terms);
  const Matrix expected = more.G() + sums.G();
  MismatchSums added = SummedUp({samples.begin() + 11, samples.end()}, terms);
  added.Add(copy);
  EXPECT_EQ(added.G(), expected);
  EXPECT_EQ(added.count(), 45);
}

}  // namespace
}  // namespace polyest::internal
