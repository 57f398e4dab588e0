#include "core/bayes/straight_coordinates.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "core/bayes/prior.h"

namespace polyest::internal::straight_coordinates_test {
namespace {

UncertainParameter Uniform(const char* name, double lower, double upper) {
  return UncertainParameter::Uniform(name, lower, upper).value();
}

// Of all kinds: positive and negative priors, one that holds 0, and one whose logarithm is affine.
Prior Independent() {
  return Prior({Uniform("a", 1, 9), Uniform("b", -5, -2), Uniform("c", -1, 2),
                UncertainParameter::Gamma("d", 2, 3, 1).value(),
                UncertainParameter::Lognormal("e", 2, 1).value()});
}

Prior Correlated() {
  return Prior::Make({Uniform("a", 1, 9), UncertainParameter::Lognormal("b", 2, 1).value(),
                      UncertainParameter::Beta("c", 2, 3, 4, 6).value()},
                     {{"a", "b", 0.6}, {"b", "c", -0.4}})
      .value();
}

Prior Normal() {
  return Prior::Make({UncertainParameter::Normal("a", 1, 0.3).value(), Uniform("b", -9, 3),
                      UncertainParameter::Lognormal("c", 2, 1).value()},
                     {{"a", "c", 0.6}})
      .value();
}

Region Turned(int n) {
  Matrix axes = 0.1 * Matrix::Identity(n, n);
  axes.diagonal(1).setConstant(0.03);
  return Region(Vector::Constant(n, 0.3), axes);
}

// Returns log |det ∂η/∂u| by central differences.
double LogVolumeByDifferences(const StraightCoordinates& coordinates, const Vector& u,
                              const Vector& sign) {
  constexpr double kStep = 1e-5;
  const Eigen::Index n = u.size();
  Matrix shifted(2 * n, n), etas;
  for (Eigen::Index i = 0; i < n; ++i) {
    shifted.row(2 * i) = u.transpose() - kStep * Vector::Unit(n, i).transpose();
    shifted.row(2 * i + 1) = u.transpose() + kStep * Vector::Unit(n, i).transpose();
  }
  Vector unused;
  coordinates.ToLocal(shifted, sign.transpose().replicate(2 * n, 1), etas, unused);
  Matrix jacobian(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    jacobian.col(i) = (etas.row(2 * i + 1) - etas.row(2 * i)).transpose() / (2 * kStep);
  }
  return std::log(std::abs(jacobian.determinant()));
}

void ExpectRoundTrip(const Prior& prior, ParameterMap map) {
  const int n = prior.dimension();
  const Region region = Turned(n);
  StraightCoordinates coordinates(prior, region, map);
  ASSERT_TRUE(coordinates.curved());
  Matrix etas = Matrix::Constant(2, n, 0.5), us, back;
  etas.row(1).setLinSpaced(-0.9, 0.8);
  coordinates.Choose(etas, true);
  Matrix signs;
  Vector volumes, same;
  coordinates.FromLocal(etas, us, &signs, &volumes);
  coordinates.ToLocal(us, signs, back, same);
  EXPECT_LT((back - etas).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((same - volumes).cwiseAbs().maxCoeff(), 1e-12);
  // Volumes are known up to a constant.
  const double difference =
      LogVolumeByDifferences(coordinates, us.row(1).transpose(), signs.row(1).transpose()) -
      LogVolumeByDifferences(coordinates, us.row(0).transpose(), signs.row(0).transpose());
  EXPECT_NEAR(volumes[1] - volumes[0], difference, 1e-7);
}

TEST(StraightCoordinates, ComeBackAndKnowTheirVolume) {
  for (const ParameterMap map : {ParameterMap::kAffine, ParameterMap::kExponential}) {
    ExpectRoundTrip(Independent(), map);
    ExpectRoundTrip(Correlated(), map);
  }
  ExpectRoundTrip(Normal(), ParameterMap::kExponential);
}

Vector At(ParameterMap map) {
  const Prior prior = Independent();
  const Region whole = Region::WholePrior(prior.dimension());
  Matrix us;
  Vector volumes;
  StraightCoordinates(prior, whole, map)
      .FromLocal(Matrix::Constant(1, prior.dimension(), 0.5), us, nullptr, &volumes);
  return us.row(0).transpose();
}

TEST(StraightCoordinates, OfProductsAreLogarithmsWhereThePriorHasOneSign) {
  const Vector u = At(ParameterMap::kExponential);
  EXPECT_NEAR(u[0], std::log(7.0), 1e-15);
  EXPECT_NEAR(u[1], std::log(2.75), 1e-15);
  EXPECT_EQ(u[2], 0.5);  // may be 0
  EXPECT_NEAR(u[3], std::log(2.5), 1e-15);
  EXPECT_EQ(u[4], 0.5);  // its logarithm is affine
}

// Three normal parameters: one positive at all points, one negative, one of both signs.
TEST(StraightCoordinates, OfProductsAreLogarithmsByChoiceWhereThePriorHasBothSigns) {
  const Prior prior({UncertainParameter::Normal("a", 1, 0.5).value(),
                     UncertainParameter::Normal("b", -1, 0.5).value(),
                     UncertainParameter::Normal("c", 0, 1).value()});
  const Region whole = Region::WholePrior(3);
  StraightCoordinates coordinates(prior, whole, ParameterMap::kExponential);
  ASSERT_TRUE(coordinates.curved() && coordinates.has_choice());
  Matrix points(2, 3), us, signs;
  points << 1, 1, -1, -1, -1, 2;  // a = 1.5, 0.5; b = −0.5, −1.5; c = −1, 2
  Vector volumes;
  coordinates.FromLocal(points, us, &signs, &volumes);
  EXPECT_EQ(us, points);
  EXPECT_EQ(volumes, Vector::Zero(2));
  coordinates.Choose(points, false);
  coordinates.FromLocal(points, us, &signs, &volumes);
  EXPECT_NEAR(us(0, 0), std::log(1.5), 1e-15);
  EXPECT_NEAR(us(0, 1), std::log(0.5), 1e-15);
  EXPECT_EQ(us.col(2), points.col(2));
  EXPECT_EQ(signs.col(0), Vector::Ones(2));
  EXPECT_EQ(signs.col(1), -Vector::Ones(2));
  EXPECT_NEAR(volumes[0], std::log(0.75), 1e-15);
  coordinates.Choose(points, true);
  coordinates.FromLocal(points, us, &signs, &volumes);
  EXPECT_NEAR(us(1, 2), std::log(2.0), 1e-15);
  EXPECT_EQ(signs.col(2), (Vector(2) << -1, 1).finished());
}

TEST(StraightCoordinates, OfSumsAreParametersThatAreNotAffine) {
  const Vector u = At(ParameterMap::kAffine);
  EXPECT_EQ(u.head(4), Vector::Constant(4, 0.5));
  EXPECT_NEAR(u[4], Independent().OfScore(4, 0.5), 1e-15);
}

TEST(StraightCoordinates, AreNotCurvedWhereAllAreAffine) {
  const Region whole = Region::WholePrior(3);
  const Prior logarithms({UncertainParameter::Lognormal("a", 2, 1).value(),
                          UncertainParameter::LogUniform("b", 1, 3).value()});
  EXPECT_FALSE(StraightCoordinates(logarithms, whole, ParameterMap::kExponential).curved());
  const Prior affine({Uniform("a", 1, 2), Uniform("b", 1, 3), Uniform("c", -1, 1)});
  EXPECT_FALSE(StraightCoordinates(affine, whole, ParameterMap::kAffine).curved());
}

TEST(StraightCoordinates, LeaveOmegaWhereTheParameterDoes) {
  for (const Prior& prior : {Independent(), Correlated()}) {
    const Region whole = Region::WholePrior(prior.dimension());
    Matrix us = Matrix::Zero(1, prior.dimension()), etas;
    us(0, 0) = std::log(9.1);
    Vector volumes;
    StraightCoordinates(prior, whole, ParameterMap::kExponential)
        .ToLocal(us, Matrix::Ones(1, prior.dimension()), etas, volumes);
    EXPECT_FALSE(prior.Contains(etas.row(0).transpose()));
  }
}

}  // namespace
}  // namespace polyest::internal::straight_coordinates_test
