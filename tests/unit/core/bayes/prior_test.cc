#include "core/bayes/prior.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/bayes/region.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Prior OneOfEach() {
  return Prior({UncertainParameter::Normal("c", 0.2, 0.03).value(),
                UncertainParameter::Uniform("k", 30, 50).value(),
                UncertainParameter::Beta("v0", 2, 2, 0.5, 1.5).value(),
                UncertainParameter::Gamma("g", 4, 0.1, 1).value()});
}

TEST(Prior, HasTheMomentsOfItsDensities) {
  const Prior prior = OneOfEach();
  // The moments are the textbook ones: uniform width/√12, beta(2, 2) on a unit width √(1/20), gamma
  // √shape · scale.
  EXPECT_TRUE(prior.Mean().isApprox(Eigen::Vector4d(0.2, 40, 1, 1.4), 1e-14));
  EXPECT_TRUE(prior.StandardDeviation().isApprox(
      Eigen::Vector4d(0.03, 20 / std::sqrt(12.0), std::sqrt(0.05), 0.2), 1e-14));
}

TEST(Prior, MapsBetweenGermsAndParameters) {
  const Prior prior = OneOfEach();
  const Eigen::Vector4d xi(-1.5, 0.25, -0.5, 3);
  const Vector theta = prior.ToParameters(xi);
  EXPECT_TRUE(theta.isApprox(Eigen::Vector4d(0.155, 42.5, 0.75, 1.3), 1e-14));
  EXPECT_TRUE(prior.ToGerm(theta).isApprox(xi, 1e-12));
}

TEST(Prior, NegativeLogDensityIsTheSumOfTheClosedForms) {
  const Prior prior = OneOfEach();
  const Eigen::Vector4d xi(-1.5, 0.25, -0.5, 3);
  // The four densities are the normal, ½, ¾ (1 − ξ²) and ξ³ e^{−ξ}/Γ(4).
  const double expected = 0.5 * std::log(2 * M_PI) + 1.125 + std::log(2.0) - std::log(0.75 * 0.75) -
                          (3 * std::log(3.0) - 3 - std::log(6.0));
  EXPECT_NEAR(prior.NegativeLogDensity(xi), expected, 1e-13);
}

TEST(Prior, NegativeLogDensityOfManyIsThatOfEach) {
  const Prior prior = OneOfEach();
  Matrix xis(4, 4);
  xis << -1.5, 0.25, -0.5, 3, -9, 1, 0, 0.5, kInfinity, 0, 0, 1, 0, -1.1, 0, 1;
  Vector values(4);
  prior.NegativeLogDensityMany(xis, values);
  for (Eigen::Index i = 0; i < 4; ++i) {
    EXPECT_DOUBLE_EQ(values[i], prior.NegativeLogDensity(xis.row(i).transpose())) << i;
  }
  EXPECT_EQ(values.tail(2), Vector::Constant(2, kInfinity));  // outside
}

TEST(Prior, DerivativesAreThoseOfTheClosedForms) {
  const Prior prior = OneOfEach();
  const Eigen::Vector4d xi(-1.5, 0.25, -0.5, 3);
  // The derivatives are those of ξ²/2, a constant, −log(1 − ξ²) and ξ − 3 log ξ.
  EXPECT_TRUE(prior.Gradient(xi).isApprox(Eigen::Vector4d(-1.5, 0, -1 / 0.75, 0), 1e-13));
  EXPECT_TRUE(prior.Curvature(xi).isApprox(Eigen::Vector4d(1, 0, 2 * 1.25 / (0.75 * 0.75), 3.0 / 9),
                                           1e-13));
}

TEST(Prior, IsInfiniteOutsideItsSupport) {
  const Prior prior = OneOfEach();
  const Eigen::Vector4d inside(-9, 1, 0, 0.5);
  EXPECT_TRUE(prior.Contains(inside));
  EXPECT_TRUE(std::isfinite(prior.NegativeLogDensity(inside)));
  for (const auto& [column, value] :
       {std::pair{0, kNan}, {1, 1 + 1e-15}, {2, -1.1}, {3, -1e-9}, {3, kInfinity}}) {
    Eigen::Vector4d xi = inside;
    xi[column] = value;
    EXPECT_FALSE(prior.Contains(xi)) << column << " " << value;
    EXPECT_EQ(prior.NegativeLogDensity(xi), kInfinity) << column << " " << value;
  }
}

std::string Refusal(const absl::StatusOr<UncertainParameter>& parameter) {
  EXPECT_EQ(parameter.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(parameter.status().message());
}

TEST(UncertainParameter, RefusalNamesParameterValueAndRule) {
  EXPECT_THAT(Refusal(UncertainParameter::Uniform("k", 5, 3)),
              HasSubstr("uniform: lower 5 must be below upper 3"));
  EXPECT_THAT(Refusal(UncertainParameter::Uniform("k", 3, 3)), HasSubstr("must be below"));
  EXPECT_THAT(Refusal(UncertainParameter::Uniform("k", -kInfinity, 3)), HasSubstr("lower: -inf"));
  EXPECT_THAT(Refusal(UncertainParameter::Uniform("k", 0, kNan)), HasSubstr("upper: nan"));
  EXPECT_THAT(Refusal(UncertainParameter::Normal("c", kNan, 1)), HasSubstr("mean: nan"));
  EXPECT_THAT(Refusal(UncertainParameter::Normal("c", 0, -1)),
              HasSubstr("normal.std_dev: -1 must be > 0"));
  EXPECT_THAT(Refusal(UncertainParameter::Normal("c", 0, kNan)), HasSubstr("must be > 0"));
  EXPECT_THAT(Refusal(UncertainParameter::Normal("c", 0, 1e200)), HasSubstr("must lie between"));
  EXPECT_THAT(Refusal(UncertainParameter::Beta("v", 0.5, 2, 0, 1)),
              HasSubstr("beta.alpha: 0.5 must lie between 1 and"));
  EXPECT_THAT(Refusal(UncertainParameter::Beta("v", 2, kNan, 0, 1)), HasSubstr("beta: nan"));
  EXPECT_THAT(Refusal(UncertainParameter::Gamma("g", 0.9, 1, 0)), HasSubstr("shape: 0.9"));
  EXPECT_THAT(Refusal(UncertainParameter::Gamma("g", 2, 0, 0)),
              HasSubstr("gamma.scale: 0 must be > 0"));
  EXPECT_THAT(Refusal(UncertainParameter::Gamma("g", 2, 1, kNan)), HasSubstr("shift: nan"));
  EXPECT_THAT(Refusal(UncertainParameter::Normal("", 0, 1)), HasSubstr("name"));
}

TEST(Region, WholePriorIsTheIdentity) {
  const Region region = Region::WholePrior(3);
  const Eigen::Vector3d eta(0.1, -2, 7);
  EXPECT_EQ(region.ToGerm(eta), eta);
  EXPECT_EQ(region.ToLocal(eta), eta);
  EXPECT_EQ(region.LogVolume(), 0);
}

// The determinant of 64 axes of 10⁻⁶ is 10⁻³⁸⁴, which underflows; that of 64 axes of 10⁶ overflows.
TEST(Region, HasAVolumeInManyDimensions) {
  for (const double axis : {1e-6, 1e6}) {
    const Region region(Vector::Zero(64), axis * Matrix::Identity(64, 64));
    EXPECT_NEAR(region.LogVolume(), 64 * std::log(axis), 1e-11);
    const Vector xi = Vector::Constant(64, 0.5 * axis);
    EXPECT_TRUE(region.ToLocal(xi).isApprox(Vector::Constant(64, 0.5)));
  }
}

TEST(Region, MapsThereAndBackOneOrMany) {
  Matrix axes(2, 2);
  axes << 0.1, 2, -0.3, 1;  // determinant 0.7
  const Region region(Eigen::Vector2d(3, -4), axes);
  EXPECT_NEAR(region.LogVolume(), std::log(0.7), 1e-15);
  EXPECT_TRUE(region.ToGerm(Eigen::Vector2d(1, 1)).isApprox(Eigen::Vector2d(5.1, -3.3)));
  Matrix etas(3, 2);
  etas << 0, 0, 1, 1, -0.5, 0.25;
  const Matrix xis = region.ManyToGerm(etas);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(xis.row(i).transpose().isApprox(region.ToGerm(etas.row(i).transpose()), 1e-14));
    EXPECT_TRUE(region.ToLocal(xis.row(i).transpose()).isApprox(etas.row(i).transpose(), 1e-13) ||
                i == 0);
  }
  EXPECT_LT((region.ManyToLocal(xis) - etas).cwiseAbs().maxCoeff(), 1e-14);
}

}  // namespace
}  // namespace polyest::internal
