#include "core/chaos/multi_index.h"

#include <gtest/gtest.h>

#include <limits>

namespace polyest {
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
  EXPECT_TRUE((TotalDegreeIndices(3, 2) == expected).all());
}

TEST(MultiIndex, TermsAreDistinctAndOfAtMostTheOrder) {
  const Eigen::ArrayXXi indices = TotalDegreeIndices(4, 5);
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
  const Eigen::ArrayXXi indices = TotalDegreeIndices(1, 3);
  for (int j = 0; j <= 3; ++j) EXPECT_EQ(indices(j, 0), j);
}

}  // namespace
}  // namespace polyest
