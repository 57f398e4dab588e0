#include "core/chaos/multi_index.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

TEST(MultiIndex, TermCountIsTheBinomialCoefficient) {
  EXPECT_EQ(TotalDegreeTermCount(1, 5), 6);
  EXPECT_EQ(TotalDegreeTermCount(2, 3), 10);
  EXPECT_EQ(TotalDegreeTermCount(5, 3), 56);
  EXPECT_EQ(TotalDegreeTermCount(12, 2), 91);
  EXPECT_EQ(TotalDegreeTermCount(7, 0), 1);
  EXPECT_EQ(TotalDegreeTermCount(30, 30), 118264581564861424);  // C(60, 30)
}

TEST(MultiIndex, TermCountSaturatesInsteadOfOverflowing) {
  EXPECT_EQ(TotalDegreeTermCount(100, 100), std::numeric_limits<int64_t>::max());
}

TEST(MultiIndex, TermsAreSortedByDegreeWithTheFirstVariableLeading) {
  Eigen::ArrayXXi expected(10, 3);
  expected << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 2, 0, 0, 1, 1, 0, 1, 0, 1, 0, 2, 0, 0, 1, 1, 0, 0,
      2;
  EXPECT_TRUE((MultiIndices(3, {2, 1}) == expected).all());
}

TEST(MultiIndex, TermsAreDistinctAndOfAtMostTheOrder) {
  const Eigen::ArrayXXi indices = MultiIndices(4, {5, 1});
  ASSERT_EQ(indices.rows(), TotalDegreeTermCount(4, 5));
  EXPECT_GE(indices.minCoeff(), 0);
  EXPECT_LE(indices.rowwise().sum().maxCoeff(), 5);
  for (Eigen::Index s = 1; s < indices.rows(); ++s) {
    for (Eigen::Index r = 0; r < s; ++r) {
      EXPECT_TRUE((indices.row(s) != indices.row(r)).any()) << s << " equals " << r;
    }
  }
}

TEST(MultiIndex, OneVariableCountsUpItsDegree) {
  const Eigen::ArrayXXi indices = MultiIndices(1, {3, 0.5});
  for (int j = 0; j <= 3; ++j) EXPECT_EQ(indices(j, 0), j);
}

TEST(MultiIndex, AHyperbolicSetHasEveryIndexWithinItsBoundAndNoOther) {
  for (const double exponent : {0.4, 0.5, 0.75}) {
    const Eigen::ArrayXXi all = MultiIndices(3, {6, 1});
    const Eigen::ArrayXXi some = MultiIndices(3, {6, exponent});
    Eigen::Index s = 0;
    for (Eigen::Index r = 0; r < all.rows(); ++r) {
      const double norm = all.row(r).cast<double>().pow(exponent).sum();
      if (norm > std::pow(6, exponent) + 1e-9) continue;
      ASSERT_LT(s, some.rows());
      EXPECT_TRUE((some.row(s++) == all.row(r)).all()) << exponent << ", row " << r;
    }
    EXPECT_EQ(s, some.rows()) << exponent;
    EXPECT_LT(some.rows(), all.rows()) << exponent;
    EXPECT_EQ(TermCount(3, {6, exponent}, 1000), some.rows());
  }
}

// Sums that meet the bound belong to the set: √1 + √1 = √4 and √1 + √1 + √1 = √9.
TEST(MultiIndex, TheHyperbolicBoundItselfBelongsToTheSet) {
  EXPECT_EQ(TermCount(2, {3, 0.5}, 100), 7);  // 1, and three of each variable alone
  EXPECT_EQ(TermCount(2, {4, 0.5}, 100), 10);
  EXPECT_EQ(MultiIndices(3, {9, 0.5}).rowwise().minCoeff().maxCoeff(), 1);
}

TEST(MultiIndex, CountingStopsPastTheMost) {
  EXPECT_EQ(TermCount(40, {40, 0.9}, 2000), 2001);
  EXPECT_EQ(TermCount(40, {40, 1}, 2000), 2001);
  EXPECT_EQ(TermCount(12, {3, 0.7}, 2000), MultiIndices(12, {3, 0.7}).rows());
  EXPECT_EQ(TermCount(2'000, {1'999, 0.5}, 2'000), 2'001);
  // However far, and without listing the degrees.
  EXPECT_EQ(TermCount(2, {std::numeric_limits<int>::max(), 0.5}, 500), 501);
}

}  // namespace
}  // namespace polyest::internal
