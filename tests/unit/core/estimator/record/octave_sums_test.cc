// Tests the histogram of magnitudes by octaves.

#include "core/estimator/record/octave_sums.h"

#include <gtest/gtest.h>

#include <limits>

namespace polyest::internal {
namespace {

TEST(OctaveSums, FindTheUsualMagnitude) {
  OctaveSums sums;
  EXPECT_EQ(sums.Usual(), 0);
  for (const double magnitude : {1.0, 1.5, 1.25, 0.0, 900.0}) sums.Add(magnitude);
  EXPECT_EQ(sums.Usual(), 1.25);  // of 1, 1.5 and 1.25
  EXPECT_EQ(sums.count(), 5);
  EXPECT_EQ(sums.CountAbove(10), 1);
  EXPECT_EQ(sums.CountAbove(1.25), 1);  // an octave counts by its mean
  EXPECT_EQ(sums.CountAbove(1.2), 4);
  EXPECT_TRUE(sums.IsConsistent());
}

TEST(OctaveSums, TakeZerosAndExtremes) {
  OctaveSums sums;
  for (const double magnitude : {0.0, 0.0, 0.0, 1e-300, 1e300}) sums.Add(magnitude);
  EXPECT_LT(sums.Usual(), 1e-300);
  EXPECT_TRUE(sums.IsConsistent());
}

}  // namespace
}  // namespace polyest::internal
