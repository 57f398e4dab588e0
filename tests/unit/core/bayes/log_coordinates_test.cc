#include "core/bayes/log_coordinates.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "core/bayes/prior.h"

namespace polyest::internal::log_coordinates_test {
namespace {

UncertainParameter Uniform(const char* name, double lower, double upper) {
  return UncertainParameter::Uniform(name, lower, upper).value();
}

// Of all kinds: positive and negative priors, one that holds 0, and one whose logarithm is affine.
Prior Independent() {
  return Prior({Uniform("a", 1, 9), Uniform("b", -5, -2), Uniform("c", -1, 2),
                UncertainParameter::Gamma("d", 2, 3, 0).value(),
                UncertainParameter::Lognormal("e", 2, 1).value()});
}

Prior Correlated() {
  return Prior::Make({Uniform("a", 1, 9), UncertainParameter::Lognormal("b", 2, 1).value(),
                      UncertainParameter::Beta("c", 2, 3, 4, 6).value()},
                     {{"a", "b", 0.6}, {"b", "c", -0.4}})
      .value();
}

Region Turned(int n) {
  Matrix axes = 0.1 * Matrix::Identity(n, n);
  axes.diagonal(1).setConstant(0.03);
  return Region(Vector::Constant(n, 0.3), axes);
}

// Returns log |det ∂η/∂u| by central differences.
double LogVolumeByDifferences(const LogCoordinates& logs, const Vector& u) {
  constexpr double kStep = 1e-5;
  const Eigen::Index n = u.size();
  Matrix shifted(2 * n, n), etas;
  for (Eigen::Index i = 0; i < n; ++i) {
    shifted.row(2 * i) = u.transpose() - kStep * Vector::Unit(n, i).transpose();
    shifted.row(2 * i + 1) = u.transpose() + kStep * Vector::Unit(n, i).transpose();
  }
  Vector unused;
  logs.ToLocal(shifted, etas, unused);
  Matrix jacobian(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    jacobian.col(i) = (etas.row(2 * i + 1) - etas.row(2 * i)).transpose() / (2 * kStep);
  }
  return std::log(std::abs(jacobian.determinant()));
}

TEST(LogCoordinates, ComeBackAndKnowTheirVolume) {
  for (const Prior& prior : {Independent(), Correlated()}) {
    const int n = prior.dimension();
    const Region region = Turned(n);
    const LogCoordinates logs(prior, region);
    ASSERT_TRUE(logs.curved());
    Matrix etas = Matrix::Constant(2, n, 0.5), us, back;
    etas.row(1).setLinSpaced(-0.9, 0.8);
    Vector volumes, same;
    logs.FromLocal(etas, us, volumes);
    logs.ToLocal(us, back, same);
    EXPECT_LT((back - etas).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((same - volumes).cwiseAbs().maxCoeff(), 1e-12);
    // Volumes are known up to a constant.
    const double difference = LogVolumeByDifferences(logs, us.row(1).transpose()) -
                              LogVolumeByDifferences(logs, us.row(0).transpose());
    EXPECT_NEAR(volumes[1] - volumes[0], difference, 1e-7);
  }
}

TEST(LogCoordinates, AreLogarithmsWhereThePriorHasOneSign) {
  const Prior prior = Independent();
  const Region whole = Region::WholePrior(prior.dimension());
  const Matrix etas = Matrix::Constant(1, prior.dimension(), 0.5);
  Matrix us;
  Vector volumes;
  LogCoordinates(prior, whole).FromLocal(etas, us, volumes);
  EXPECT_NEAR(us(0, 0), std::log(7.0), 1e-15);
  EXPECT_NEAR(us(0, 1), std::log(2.75), 1e-15);
  EXPECT_EQ(us(0, 2), 0.5);  // may be 0
  EXPECT_NEAR(us(0, 3), std::log(1.5), 1e-15);
  EXPECT_EQ(us(0, 4), 0.5);  // its logarithm is affine
}

TEST(LogCoordinates, AreNotCurvedWhereAllLogarithmsAreAffine) {
  const Prior prior({UncertainParameter::Lognormal("a", 2, 1).value(),
                     UncertainParameter::LogUniform("b", 1, 3).value(), Uniform("c", -1, 1)});
  const Region whole = Region::WholePrior(3);
  EXPECT_FALSE(LogCoordinates(prior, whole).curved());
}

TEST(LogCoordinates, LeaveOmegaWhereTheParameterDoes) {
  for (const Prior& prior : {Independent(), Correlated()}) {
    const Region whole = Region::WholePrior(prior.dimension());
    Matrix us = Matrix::Zero(1, prior.dimension()), etas;
    us(0, 0) = std::log(9.1);
    Vector volumes;
    LogCoordinates(prior, whole).ToLocal(us, etas, volumes);
    EXPECT_FALSE(prior.Contains(etas.row(0).transpose()));
  }
}

}  // namespace
}  // namespace polyest::internal::log_coordinates_test
