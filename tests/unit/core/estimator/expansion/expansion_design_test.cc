#include "core/estimator/expansion/expansion_design.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/chaos/collocation_points.h"
#include "polyest/catalogue.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

ResolvedProblem ProblemWith(std::vector<UncertainParameter> uncertain, int order) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.uncertain = std::move(uncertain);
  problem.measured = {{"x", {.absolute = 0.1}}};
  problem.expansion.order = order;
  return ResolvedProblem::Make(std::move(problem)).value();
}

ResolvedProblem TwoUniforms() {
  return ProblemWith({UncertainParameter::Uniform("x0", 0, 2).value(),
                      UncertainParameter::Uniform("v0", 0, 2).value()},
                     3);
}

// Returns an expansion over the box of half widths (0.2, 0.3) about (0.8, 0). Its first axis ends
// at Ω's upper bound.
ExpansionDesign AtTheBound(const ResolvedProblem& problem) {
  const Vector centre = Eigen::Vector2d(0.8, 0);
  const Matrix axes = Eigen::Vector2d(0.2, 0.3).asDiagonal();
  return DesignForRegion(problem, {3, 1}, Region(centre, axes), centre);
}

// Returns 1,000 particles about the middle, with `at_edge` of them moved to `edge`.
Matrix ParticlesWith(int at_edge, const Eigen::RowVector2d& edge) {
  Matrix etas = 0.5 * UnitCubePoints(PointSet::kHalton, 2, 1000).array() - 0.25;
  etas.topRows(at_edge).rowwise() = edge;
  return etas;
}

// The oracle is the radical inverses in base 2 of 1 … 12, mapped through the distribution of
// Beta(2, 2) on [−1, 1], F(ξ) = ½ + ¾ ξ − ¼ ξ³.
TEST(DesignForPrior, HasThePapersTwelvePointsForSixTerms) {
  const ResolvedProblem problem =
      ProblemWith({UncertainParameter::Beta("v0", 2, 2, 0.5, 1.5).value()}, 5);
  const ExpansionDesign design = DesignForPrior(problem).value();
  EXPECT_EQ(design.basis->size(), 6);
  ASSERT_EQ(design.points.rows(), 12);
  const double sixteenths[] = {8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3};
  for (int q = 0; q < 12; ++q) {
    const double xi = design.points(q, 0);
    EXPECT_NEAR(0.5 + 0.75 * xi - 0.25 * xi * xi * xi, sixteenths[q] / 16, 1e-12);
  }
  EXPECT_TRUE(design.whole_prior);
  EXPECT_EQ(design.lower[0], -1);
  EXPECT_EQ(design.upper[0], 1);
}

TEST(DesignForPrior, TrustsAnUnboundedGermBetweenItsOuterThousandths) {
  const ResolvedProblem problem = ProblemWith({UncertainParameter::Normal("v0", 0, 1).value(),
                                               UncertainParameter::Gamma("x0", 2, 1, 0).value()},
                                              2);
  const ExpansionDesign design = DesignForPrior(problem).value();
  EXPECT_NEAR(design.lower[0], -3.090232306167814, 1e-9);  // Φ⁻¹(0.001)
  EXPECT_NEAR(design.upper[0], 3.090232306167814, 1e-9);
  EXPECT_EQ(design.lower[1], 0);
  // The oracle for Gamma(2) is 1 − F(x) = (1 + x) e^{−x}.
  EXPECT_NEAR((1 + design.upper[1]) * std::exp(-design.upper[1]), 0.001, 1e-9);
}

// The oracle: with v0 = h η, h = −Φ⁻¹(10⁻⁶), the normalized Legendre polynomials √3 η and
// √5 (3 η² − 1)/2 have these moments, since E[v0²] = 1 and E[v0⁴] = 3.
TEST(DesignForTails, KnowsTheMomentsOfItsPolynomialsUnderThePrior) {
  const ResolvedProblem problem = ProblemWith({UncertainParameter::Normal("v0", 0, 1).value()}, 2);
  EXPECT_TRUE(BeginsInTails(problem));
  EXPECT_FALSE(BeginsInTails(TwoUniforms()));
  const ExpansionDesign design = DesignToBeginWith(problem).value();
  EXPECT_TRUE(design.in_tails);
  const double h = 4.753424308822899, square = 1 / (h * h);
  constexpr double kOfBound = 1e-10;  // 1 − 10⁻⁶ is rounded by 1e-16, its quantile by 2e-11
  const PriorMoments moments = MomentsUnderPrior(problem.prior(), design);
  EXPECT_NEAR(moments.mean[0], 1, 1e-12);
  EXPECT_NEAR(moments.mean[1], 0, kOfBound);
  EXPECT_NEAR(moments.mean[2], std::sqrt(5) / 2 * (3 * square - 1), kOfBound);
  EXPECT_NEAR(moments.covariance(0, 0), 0, 1e-12);
  EXPECT_NEAR(moments.covariance(1, 1), 3 * square, kOfBound);
  EXPECT_NEAR(moments.covariance(2, 2), 5.0 / 4 * 9 * (3 - 1) * square * square, kOfBound);
}

TEST(DesignForPrior, ChecksAtPointsThatAreNotCollocationPoints) {
  const ExpansionDesign design = DesignForPrior(TwoUniforms()).value();
  ASSERT_GT(design.check_points.rows(), 0);
  EXPECT_EQ(design.check_costs.size(), design.check_points.rows());
  for (Eigen::Index i = 0; i < design.check_points.rows(); ++i) {
    const auto distances =
        (design.points.rowwise() - design.check_points.row(i)).rowwise().norm().eval();
    EXPECT_GT(distances.minCoeff(), 1e-3);
  }
}

TEST(DesignForRegion, IsTheCubesOwnPointsWhereTheRegionLiesInside) {
  const ResolvedProblem problem = TwoUniforms();
  const Vector centre = Vector::Zero(2);
  const ExpansionDesign design =
      DesignForRegion(problem, {3, 1}, Region(centre, 0.1 * Matrix::Identity(2, 2)), centre);
  EXPECT_EQ(design.points.rows(), 20);
  EXPECT_EQ(design.points, Matrix(2 * UnitCubePoints(PointSet::kHalton, 2, 20).array() - 1));
  EXPECT_FALSE(design.whole_prior);
}

TEST(DesignForRegion, DrawsPointsIntoThePrior) {
  const ResolvedProblem problem = TwoUniforms();
  const Vector centre = Eigen::Vector2d(0.95, -0.9);
  Matrix axes(2, 2);
  axes << 0.3, 0.2, -0.2, 0.3;
  const Region region(centre, axes);
  const Vector inside = Eigen::Vector2d(0.8, -0.8);
  const ExpansionDesign design = DesignForRegion(problem, {3, 1}, region, inside);
  const Matrix xis = region.ManyToGerm(design.points);
  EXPECT_LE(xis.cwiseAbs().maxCoeff(), 1.0);
  const Matrix plain = region.ManyToGerm(2 * UnitCubePoints(PointSet::kHalton, 2, 20).array() - 1);
  int drawn = 0;
  for (Eigen::Index q = 0; q < xis.rows(); ++q) {
    const bool was_inside = plain.row(q).cwiseAbs().maxCoeff() <= 1;
    if (was_inside) {
      EXPECT_TRUE(xis.row(q).isApprox(plain.row(q), 1e-14));
      continue;
    }
    ++drawn;
    // The point moves to the bound, except for 1e-12 of the way, on the line from the point to
    // `inside`.
    EXPECT_NEAR(xis.row(q).cwiseAbs().maxCoeff(), 1, 1e-12);
    const Eigen::Vector2d step = xis.row(q).transpose() - inside;
    const Eigen::Vector2d whole = plain.row(q).transpose() - inside;
    EXPECT_NEAR(step[0] * whole[1] - step[1] * whole[0], 0, 1e-14);
    EXPECT_GT(step.dot(whole), 0);
  }
  EXPECT_GT(drawn, 3);
  EXPECT_LT(drawn, 20);
}

TEST(RegionOfParticles, HoldsAllParticlesWithAThirdToSpare) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  Matrix xis(500, 3);
  for (Eigen::Index i = 0; i < xis.rows(); ++i) {
    const double a = normal(generator);
    xis.row(i) << 0.4 + 0.1 * a, -0.2 + 0.1 * a + 1e-4 * normal(generator),
        50 + 5 * normal(generator);
  }
  const Region region = RegionOfParticles(xis);
  const Matrix etas = region.ManyToLocal(xis);
  for (int j = 0; j < 3; ++j) {
    EXPECT_NEAR(etas.col(j).maxCoeff(), 0.75, 0.02);
    EXPECT_NEAR(etas.col(j).minCoeff(), -0.75, 0.02);
  }
  // The box lies along the principal axes. The valley between the first two parameters is 10⁻³ as
  // wide as long; a box along the parameters themselves would have the product of their widths.
  EXPECT_LT(region.LogVolume(), std::log(0.01 * 0.3 * 0.3 * 15));
}

TEST(RegionOfParticles, OfParticlesInOnePlaceIsSmallButARegion) {
  const Matrix xis = Eigen::RowVector2d(0.25, 0.5).replicate(100, 1);
  const Region region = RegionOfParticles(xis);
  EXPECT_TRUE(std::isfinite(region.LogVolume()));
  EXPECT_NEAR(region.centre()[0], 0.25, 1e-12);
}

TEST(TrustedRegion, HasTheTrustedBoxAsItsCube) {
  const ResolvedProblem problem =
      ProblemWith({UncertainParameter::Gamma("x0", 2, 1, 0).value()}, 2);
  const ExpansionDesign design = DesignForPrior(problem).value();
  const Region region = TrustedRegion(design);
  EXPECT_NEAR(region.ToGerm(Vector::Constant(1, -1))[0], design.lower[0], 1e-12);
  EXPECT_NEAR(region.ToGerm(Vector::Constant(1, 1))[0], design.upper[0], 1e-12);
  Vector lower, upper;
  SamplingBox(design, lower, upper);
  EXPECT_LT(lower[0], design.lower[0]);
  EXPECT_NEAR(upper[0] - lower[0], kOvershoot * (design.upper[0] - design.lower[0]), 1e-12);
}

TEST(LeaningAxes, AreThoseAtWhoseEdgeParticlesLie) {
  const ResolvedProblem problem = TwoUniforms();
  const ExpansionDesign design = AtTheBound(problem);
  const Prior& prior = problem.prior();
  EXPECT_THAT(LeaningAxes(design, prior, Element(), ParticlesWith(0, {0, 0})), IsEmpty());
  EXPECT_THAT(LeaningAxes(design, prior, Element(), ParticlesWith(50, {0, 0.99})), ElementsAre(1));
  EXPECT_THAT(LeaningAxes(design, prior, Element(), ParticlesWith(50, {0, -1.1})), ElementsAre(1));
  EXPECT_THAT(LeaningAxes(design, prior, Element(), ParticlesWith(50, {-0.99, 0})), ElementsAre(0));
  EXPECT_THAT(LeaningAxes(design, prior, Element(), ParticlesWith(50, {-0.99, 0.99})),
              ElementsAre(0, 1));
}

TEST(LeaningAxes, AreNotThoseThatEndWithThePrior) {
  const ResolvedProblem problem = TwoUniforms();
  EXPECT_THAT(
      LeaningAxes(AtTheBound(problem), problem.prior(), Element(), ParticlesWith(50, {0.99, 0})),
      IsEmpty());
  const ExpansionDesign whole = DesignForPrior(problem).value();
  EXPECT_THAT(LeaningAxes(whole, problem.prior(), Element(), ParticlesWith(50, {0.99, -0.99})),
              IsEmpty());
}

TEST(LeaningAxes, TakeMoreThanOneParticleInAHundred) {
  const ResolvedProblem problem = TwoUniforms();
  const ExpansionDesign design = AtTheBound(problem);
  EXPECT_THAT(LeaningAxes(design, problem.prior(), Element(), ParticlesWith(10, {0, 0.99})),
              IsEmpty());
  EXPECT_THAT(LeaningAxes(design, problem.prior(), Element(), ParticlesWith(11, {0, 0.99})),
              ElementsAre(1));
}

// Of the ended runs only their region counts here, a box along (1, 1) and (−1, 1) about (0.2, 0).
TEST(WithinKnown, IsTheBoxOfTheEndedRunsWithTheOvershoot) {
  ResolvedProblem problem = TwoUniforms();
  const Element all;
  EXPECT_TRUE(WithinKnown(problem, all).bounds().empty());
  auto ended = std::make_shared<EndedRuns>();
  Matrix axes(2, 2);
  axes << 0.3, -0.1, 0.3, 0.1;
  ended->region = Region(Eigen::Vector2d(0.2, 0), axes);
  problem.set_ended_runs(ended);
  const Element known = WithinKnown(problem, all);
  for (const Eigen::Vector2d& eta :
       {Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, 1), Eigen::Vector2d(0, -1)}) {
    EXPECT_TRUE(known.Contains(ended->region.ToGerm(0.99 * kOvershoot * eta)));
    EXPECT_FALSE(known.Contains(ended->region.ToGerm(1.01 * kOvershoot * eta)));
  }
  // What bounds the element still does.
  const auto [below, above] = all.Divide(Eigen::Vector2d(1, 0), 0.2);
  EXPECT_FALSE(WithinKnown(problem, below).Contains(Eigen::Vector2d(0.21, 0)));
}

TEST(WidenedRegion, IsWiderAndShiftedAlongItsAxesAlone) {
  const ResolvedProblem problem = TwoUniforms();
  const ExpansionDesign design = AtTheBound(problem);
  const Matrix etas = Eigen::RowVector2d(-0.5, 0.6).replicate(100, 1);
  const Region region = WidenedRegion(design, etas, {1}, 1.5);
  EXPECT_NEAR(region.centre()[0], 0.8, 1e-14);
  EXPECT_NEAR(region.centre()[1], 0.6 * 0.3, 1e-14);
  EXPECT_NEAR(region.axes()(0, 0), 0.2, 1e-14);
  EXPECT_NEAR(region.axes()(1, 1), 1.5 * 0.3, 1e-14);
}

}  // namespace
}  // namespace polyest::internal
