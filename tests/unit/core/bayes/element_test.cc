// Elements of the germ's space: parts on one side of hyperplanes.

#include "core/bayes/element.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(Element, OfNothingDividedHasEveryPoint) {
  EXPECT_TRUE(Element().Contains(Vector{{1e6, -1e6}}));
}

TEST(Element, IsDividedIntoPartsThatCoverItAndMeetAtTheHyperplane) {
  const auto [below, above] = Element().Divide(Vector{{1, 1}}, 1);
  const auto [left, right] = above.Divide(Vector{{1, 0}}, 0);
  int on_the_hyperplane = 0;
  for (double a = -2; a <= 2; a += 0.25) {
    for (double b = -2; b <= 2; b += 0.25) {
      const Vector xi{{a, b}};
      EXPECT_EQ(below.Contains(xi), a + b <= 1);
      EXPECT_EQ(above.Contains(xi), a + b >= 1);
      EXPECT_EQ(left.Contains(xi), a + b >= 1 && a <= 0);
      EXPECT_EQ(right.Contains(xi), a + b >= 1 && a >= 0);
      if (below.Contains(xi) && above.Contains(xi)) ++on_the_hyperplane;
    }
  }
  EXPECT_GT(on_the_hyperplane, 0);
}

// The particles of the quadrant on the upper left press on the hyperplane to its right.
TEST(Element, TakesThePlaceOfThoseThatAreGoneWhereItsParticlesPress) {
  const auto [below, above] = Element().Divide(Vector{{0, 1}}, 0);
  const auto [left, right] = above.Divide(Vector{{1, 0}}, 0);
  Matrix particles(101, 2);
  particles.col(0) = Vector::LinSpaced(101, -1, 0);
  particles.col(1) = Vector::LinSpaced(101, 5, 6);
  const Vector to_the_right{{1, 1}}, underneath{{-1, -1}};
  EXPECT_EQ(left.Freed({&below, &right}, particles).bounds().size(), 2u);
  EXPECT_TRUE(left.Freed({&below}, particles).Contains(to_the_right));
  EXPECT_FALSE(left.Freed({&below}, particles).Contains(underneath));
  EXPECT_FALSE(left.Freed({&right}, particles).Contains(underneath));
  EXPECT_TRUE(left.Freed({}, particles).Contains(to_the_right));
}

TEST(Element, IsNotBoundedInNewDimensions) {
  const Element half = Element().Divide(Vector{{1.0}}, 0.5).first.WithDimension(2);
  EXPECT_TRUE(half.Contains(Vector{{0.4, 1e9}}));
  EXPECT_FALSE(half.Contains(Vector{{0.6, 0}}));
}

TEST(Element, KeepsTheBoundsAlongGivenGermsAlone) {
  const Element first({{Vector{{1, 0, 0}}, 0.5}, {Vector{{0, 1, 0}}, 2}, {Vector{{1, 0, 1}}, 0}});
  const Element second({{Vector{{0, 1, 0}}, 2}, {Vector{{-1, 0, 0}}, -0.5}});
  EXPECT_FALSE(first.HasBoundsOf(second));
  const std::vector<int> shared = {1, 2};
  EXPECT_TRUE(first.AlongGerms(shared).HasBoundsOf(second.AlongGerms(shared)));
  EXPECT_EQ(first.AlongGerms(shared).bounds().size(), 1u);
  EXPECT_EQ(first.AlongGerms({0, 2}).bounds().size(), 2u);
}

TEST(Element, HasTheBoundsOfAnotherInAnyOrder) {
  const Element::Bound a{Vector{{1, 0}}, 1}, b{Vector{{0, 1}}, 2}, c{Vector{{0, 1}}, 3};
  EXPECT_TRUE(Element({a, b}).HasBoundsOf(Element({b, a})));
  EXPECT_FALSE(Element({a, b}).HasBoundsOf(Element({a, c})));
  EXPECT_FALSE(Element({a}).HasBoundsOf(Element({a, b})));
}

}  // namespace
}  // namespace polyest::internal
