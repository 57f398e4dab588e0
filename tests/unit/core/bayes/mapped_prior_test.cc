// Tests priors whose parameters are not affine maps of independent germs: lognormal, truncated
// normal and correlated ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/bayes/curvature.h"
#include "core/bayes/identifiability.h"
#include "core/bayes/parameter_covariance.h"
#include "core/bayes/prior.h"
#include "core/chaos/collocation_points.h"

namespace polyest::internal::mapped_prior_test {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

UncertainParameter Normal(const char* name, double mean, double std_dev) {
  return UncertainParameter::Normal(name, mean, std_dev).value();
}
UncertainParameter Lognormal(const char* name, double mean, double std_dev) {
  return UncertainParameter::Lognormal(name, mean, std_dev).value();
}

// Makes five correlated parameters of all families in a chain, and an uncorrelated one among them.
Prior Chain() {
  return Prior::Make({Normal("a", 3, 2), Lognormal("b", 40, 5),
                      UncertainParameter::Uniform("free", 0, 4).value(),
                      UncertainParameter::Uniform("c", -1, 3).value(),
                      UncertainParameter::Beta("d", 2, 5, 0, 1).value(),
                      UncertainParameter::Gamma("e", 1.5, 2, 1).value(),
                      UncertainParameter::TruncatedNormal("f", 1, 1, 0).value()},
                     {{"a", "b", 0.7},
                      {"c", "b", -0.4},
                      {"d", "c", 0.3},
                      {"e", "d", 0.5},
                      {"f", "e", -0.6}})
      .value();
}

// Moments of a constant density of log θ, by the midpoint rule in 10⁵ intervals.
TEST(LogUniform, HasItsMoments) {
  for (const auto& [lower, upper] : {std::pair{1e-4, 1.0}, {2.0, 3.0}, {1.0, 1.001}}) {
    const UncertainParameter q = UncertainParameter::LogUniform("q", lower, upper).value();
    EXPECT_TRUE(q.Validate().ok());
    EXPECT_NEAR(q.ToParameter(-1), lower, 1e-12 * lower);
    EXPECT_NEAR(q.ToParameter(1), upper, 1e-12 * upper);
    constexpr int kIntervals = 100'000;
    double mean = 0, variance = 0;
    for (const bool second : {false, true}) {
      for (int i = 0; i < kIntervals; ++i) {
        const double theta = q.ToParameter(-1 + (2 * i + 1.0) / kIntervals);
        (second ? variance : mean) += (second ? std::pow(theta - mean, 2) : theta) / kIntervals;
      }
    }
    EXPECT_NEAR(q.Mean(), mean, 1e-7 * mean);
    EXPECT_NEAR(q.StandardDeviation(), std::sqrt(variance), 1e-6 * std::sqrt(variance));
  }
  EXPECT_THAT(std::string(UncertainParameter::LogUniform("q", 0, 1).status().message()),
              HasSubstr("lower: 0 must be > 0"));
  EXPECT_FALSE(UncertainParameter::LogUniform("q", 2, 1).ok());
}

// Returns points of the prior, count × n.
Matrix PriorPoints(const Prior& prior, int count) {
  Matrix points = CollocationPoints(PointSet::kHalton, prior.germs(), 1, count).value();
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    points.row(i) = prior.ToParameters(points.row(i).transpose()).transpose();
  }
  return points;
}

double CorrelationOf(const Vector& a, const Vector& b) {
  const Vector x = a.array() - a.mean(), y = b.array() - b.mean();
  return x.dot(y) / (x.norm() * y.norm());
}

Vector Ranks(const Vector& values) {
  std::vector<Eigen::Index> order(static_cast<size_t>(values.size()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](Eigen::Index i, Eigen::Index j) { return values[i] < values[j]; });
  Vector ranks(values.size());
  for (size_t k = 0; k < order.size(); ++k) ranks[order[k]] = static_cast<double>(k);
  return ranks;
}

TEST(Lognormal, HasItsMomentsWhereItIsCutOff) {
  constexpr int kNodes = 100'000;
  UncertainParameter cut = Lognormal("cut", 40, 50);
  cut.germ = Germ::TruncatedNormal(-0.7, 1.9);
  ASSERT_TRUE(cut.Validate().ok());
  double weight = 0, first = 0, second = 0;
  for (int i = 0; i < kNodes; ++i) {  // by the midpoint rule
    const double xi = -0.7 + 2.6 * (i + 0.5) / kNodes, density = std::exp(-0.5 * xi * xi);
    weight += density;
    first += density * cut.ToParameter(xi);
    second += density * std::pow(cut.ToParameter(xi), 2);
  }
  const double mean = first / weight;
  EXPECT_NEAR(cut.Mean(), mean, 1e-8 * mean);
  EXPECT_NEAR(cut.StandardDeviation(), std::sqrt(second / weight - mean * mean), 1e-8 * mean);
}

TEST(Lognormal, HasTheMeanAndStandardDeviationGivenAndItsMedianAtTheGermsMode) {
  const Prior prior({Lognormal("k", 40, 5), Lognormal("wide", 1e-6, 5e-5)});
  EXPECT_TRUE(prior.Mean().isApprox(Eigen::Vector2d(40, 1e-6), 1e-13));
  EXPECT_TRUE(prior.StandardDeviation().isApprox(Eigen::Vector2d(5, 5e-5), 1e-13));
  // The median of a lognormal is m/√(1 + s²/m²).
  EXPECT_NEAR(prior.ToParameters(Eigen::Vector2d::Zero())[0], 40 / std::sqrt(1 + 1.0 / 64), 1e-13);
  EXPECT_GT(prior.ToParameters(Eigen::Vector2d::Constant(-37)).minCoeff(), 0);
  EXPECT_TRUE(prior.ToParameters(Eigen::Vector2d::Constant(37)).allFinite());
}

TEST(TruncatedNormalPrior, IsTheGermMovedAndScaled) {
  const UncertainParameter c = UncertainParameter::TruncatedNormal("c", 0.2, 0.4, 0).value();
  const Prior prior({c});
  EXPECT_NEAR(prior.ToParameters(prior.lower())[0], 0, 1e-16);
  EXPECT_EQ(prior.upper()[0], kInfinity);
  // The normal is cut at −½, so that the mean lies φ(½)/Φ(½) standard deviations above that of the
  // whole normal.
  const double ratio = 0.35206532676429952 / 0.69146246127401312;
  EXPECT_NEAR(prior.Mean()[0], 0.2 + 0.4 * ratio, 1e-14);
  EXPECT_NEAR(prior.StandardDeviation()[0], 0.4 * std::sqrt(1 - 0.5 * ratio - ratio * ratio),
              1e-14);
}

TEST(MappedPrior, GermsAndParametersMapThereAndBack) {
  const Prior prior = Chain();
  const Matrix xis = CollocationPoints(PointSet::kHalton, prior.germs(), 1, 200).value();
  for (Eigen::Index i = 0; i < xis.rows(); ++i) {
    const Vector xi = xis.row(i).transpose();
    // Quantiles are exact to 10⁻¹² of a standard deviation. The slope of a score against its
    // parameter stays below a thousand prior standard deviations at such points.
    EXPECT_LT((prior.ToGerm(prior.ToParameters(xi)) - xi).cwiseAbs().maxCoeff(), 1e-8) << i;
  }
}

TEST(MappedPrior, JacobianIsThatOfTheMap) {
  const Prior prior = Chain();
  const Matrix xis = CollocationPoints(PointSet::kHalton, prior.germs(), 1, 20).value();
  const double h = 1e-3;
  for (Eigen::Index i = 0; i < xis.rows(); ++i) {
    const Vector xi = xis.row(i).transpose();
    const Matrix jacobian = prior.Jacobian(xi);
    for (int j = 0; j < prior.dimension(); ++j) {
      const Vector step = h * Vector::Unit(prior.dimension(), j);
      const auto at = [&](double factor) { return prior.ToParameters(xi + factor * step); };
      const Vector difference = (at(-2) - 8 * at(-1) + 8 * at(1) - at(2)) / (12 * h);  // O(h⁴)
      EXPECT_LT(((jacobian.col(j) - difference).cwiseQuotient(prior.StandardDeviation()))
                    .cwiseAbs()
                    .maxCoeff(),
                1e-8);
    }
  }
}

// The star discrepancy of 20,000 Halton points in seven dimensions is below 0.01 in practice. The
// moments of heavy tails suffer most.
TEST(MappedPrior, PointsHaveTheMarginalsMomentsAndTheCopulasRankCorrelations) {
  const Prior prior = Chain();
  const Matrix points = PriorPoints(prior, 20'000);
  const Vector mean = prior.Mean(), deviation = prior.StandardDeviation();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    EXPECT_NEAR(points.col(i).mean(), mean[i], 0.01 * deviation[i]) << i;
    const Vector centred = points.col(i).array() - mean[i];
    EXPECT_NEAR(std::sqrt(centred.squaredNorm() / 20'000), deviation[i], 0.01 * deviation[i]) << i;
  }
  const Matrix covariance =
      ParameterCovariance(prior, Vector::Zero(prior.dimension()),
                          prior.factor() * prior.GermStandardDeviation().asDiagonal());
  for (const auto& [i, j, rho] : {std::tuple{0, 1, 0.7},
                                  {1, 3, -0.4},
                                  {3, 4, 0.3},
                                  {4, 5, 0.5},
                                  {5, 6, -0.6},
                                  {0, 3, 0.0},
                                  {0, 2, 0.0}}) {
    EXPECT_NEAR(CorrelationOf(Ranks(points.col(i)), Ranks(points.col(j))),
                6 / std::numbers::pi * std::asin(rho / 2), 0.01)
        << i << " " << j;
    EXPECT_NEAR(CorrelationOf(points.col(i), points.col(j)),
                covariance(i, j) / std::sqrt(covariance(i, i) * covariance(j, j)), 0.01)
        << i << " " << j;
  }
}

TEST(MappedPrior, CovarianceIsTheClosedForm) {
  // The covariance of a pair is ρ s s′ for normal–normal, m m′ (e^{ρσσ′} − 1) for
  // lognormal–lognormal and ρ s m σ for normal–lognormal, with σ² = log(1 + s²/m²).
  const Prior prior = Prior::Make({Normal("a", 3, 2), Normal("b", -1, 0.5), Lognormal("c", 40, 5),
                                   Lognormal("d", 1, 2)},
                                  {{"a", "b", 0.6}, {"c", "d", -0.5}, {"a", "c", 0.4}})
                          .value();
  const Matrix covariance = ParameterCovariance(prior, Vector::Zero(4), prior.factor());
  const double c = std::sqrt(std::log1p(1.0 / 64)), d = std::sqrt(std::log(5));
  EXPECT_NEAR(covariance(0, 1), 0.6, 1e-14);
  EXPECT_NEAR(covariance(2, 3), 40 * std::expm1(-0.5 * c * d), 1e-12);
  EXPECT_NEAR(covariance(0, 2), 0.4 * 2 * 40 * c, 1e-12);
  EXPECT_TRUE(covariance.diagonal().cwiseSqrt().isApprox(prior.StandardDeviation(), 1e-12));
  EXPECT_TRUE(PriorCovariance(prior).isApprox(covariance, 1e-12));
}

TEST(MappedPrior, QuadratureOfOtherFamiliesKeepsTheirStandardDeviation) {
  const Prior prior = Chain();
  const Matrix covariance =
      ParameterCovariance(prior, Vector::Zero(prior.dimension()),
                          prior.factor() * prior.GermStandardDeviation().asDiagonal());
  EXPECT_LT((covariance.diagonal().cwiseSqrt().cwiseQuotient(prior.StandardDeviation()).array() - 1)
                .abs()
                .maxCoeff(),
            1e-3);
  EXPECT_TRUE(
      PriorCovariance(prior).diagonal().isApprox(prior.StandardDeviation().cwiseAbs2(), 1e-12));
}

// Of a hundred powers of ten the exponential of half the variance would not be a number.
TEST(MappedPrior, CovarianceOfAWideLogarithmIsFinite) {
  const Prior prior =
      Prior::Make({Normal("a", 3, 2), UncertainParameter::LogUniform("b", 1e-100, 1e100).value()},
                  {})
          .value();
  const Matrix root = prior.GermStandardDeviation().asDiagonal();
  for (const double z : {-1.0, 0.0, 1.0}) {
    EXPECT_TRUE(ParameterCovariance(prior, Vector{{0, z}}, root).allFinite()) << z;
  }
}

TEST(MappedPrior, NarrowGaussiansAreMappedByTheDeltaMethod) {
  const Prior prior = Chain();
  const Vector xi = Vector::Constant(prior.dimension(), 0.3);
  const Matrix hessian = 1e8 * Matrix::Identity(prior.dimension(), prior.dimension());
  const Curvature curvature = CovarianceFromCurvature(hessian, prior, xi);
  const Matrix jacobian = prior.Jacobian(xi);
  // The next order is smaller by s² = 10⁻⁸.
  EXPECT_TRUE(curvature.covariance.isApprox(1e-8 * jacobian * jacobian.transpose(), 1e-7));
}

TEST(MappedPrior, WithoutInformationTheCurvatureGivesThePrior) {
  const Prior prior = Chain();
  Matrix hessian = Matrix::Zero(prior.dimension(), prior.dimension());
  hessian.diagonal() = prior.Curvature(Vector::Zero(prior.dimension()));
  const Curvature curvature =
      CovarianceFromCurvature(hessian, prior, Vector::Zero(prior.dimension()));
  EXPECT_TRUE(curvature.standard_deviation.isApprox(prior.StandardDeviation(), 1e-3));
  EXPECT_TRUE(curvature.contraction.isApprox(Vector::Ones(prior.dimension()), 1e-12));
}

// The oracle is a bivariate normal under conditioning: when a is measured with the curvature λ, the
// variance of b is 1 − ρ² λ/(1 + λ).
TEST(MappedPrior, WhatIsKnownOfOneIsKnownOfItsPartner) {
  const double rho = 0.95, lambda = 1e6;
  const Prior prior =
      Prior::Make({Normal("a", 0, 1), Normal("b", 0, 1)}, {{"a", "b", rho}}).value();
  // The cost is J = ½ λ z_a² + ½ ξᵀξ with z_a = ξ_a.
  const Matrix mismatch = Eigen::Vector2d(lambda, 0).asDiagonal();
  const Curvature curvature =
      CovarianceFromCurvature(mismatch + Matrix::Identity(2, 2), prior, Vector::Zero(2));
  EXPECT_NEAR(curvature.contraction[1], std::sqrt(1 - rho * rho * lambda / (1 + lambda)), 1e-9);
  EXPECT_EQ(VerdictOfContraction(curvature.contraction[1]), Verdict::kIdentified);
  // The parameter b moves ρ times as far as a along the direction of the information.
  const std::vector<Direction> directions = Directions(mismatch, prior);
  EXPECT_NEAR(directions[0].information, lambda, 1e-6);
  EXPECT_NEAR(directions[0].coefficients[1] / directions[0].coefficients[0], rho, 1e-12);
  EXPECT_NEAR(directions[1].coefficients[1], 1, 1e-12);
}

TEST(MappedPrior, WithCoefficientsOfZeroIsTheIndependentOne) {
  const UncertainParameter k = UncertainParameter::Uniform("k", 3, 5).value();
  const Prior prior = Prior::Make({k, Normal("c", 0, 1)}, {{"k", "c", 0}}).value();
  EXPECT_FALSE(prior.correlated());
  EXPECT_EQ(prior.germs()[0], Germ::Uniform());
}

TEST(MappedPrior, ValuesOutsideACorrelatedMarginalHaveNoGerm) {
  const Prior prior = Chain();
  EXPECT_TRUE(std::isnan(prior.ScoreOf(3, 3.1)));
  EXPECT_TRUE(std::isnan(prior.ScoreOf(1, -1)));
  EXPECT_EQ(prior.ScoreOf(3, 3), kInfinity);
}

std::string Refusal(const absl::Status& status) {
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

TEST(MappedParameter, RefusesWhatIsNoLognormal) {
  const auto refusal = [](double mean, double std_dev) {
    return Refusal(UncertainParameter::Lognormal("k", mean, std_dev).status());
  };
  EXPECT_THAT(refusal(0, 1), HasSubstr("lognormal.mean: 0 must be > 0"));
  EXPECT_THAT(refusal(-3, 1), HasSubstr("mean: -3 must be > 0"));
  EXPECT_THAT(refusal(kNan, 1), HasSubstr("mean: nan"));
  EXPECT_THAT(refusal(1, kInfinity), HasSubstr("std_dev: inf must lie between"));
  EXPECT_THAT(refusal(2, 201), HasSubstr("std_dev: 201 must be at most 100 times the mean 2"));
}

TEST(MappedParameter, RefusesWhatIsNoTruncatedNormal) {
  const auto refusal = [](double mean, double std_dev, double lower, double upper) {
    return Refusal(UncertainParameter::TruncatedNormal("k", mean, std_dev, lower, upper).status());
  };
  EXPECT_THAT(refusal(0, 1, 2, 2), HasSubstr("truncated_normal: lower 2 must be below upper 2"));
  EXPECT_THAT(refusal(0, 1, kNan, 2), HasSubstr("lower nan must be below"));
  EXPECT_THAT(refusal(0, 0, -1, 2), HasSubstr("std_dev: 0 must be > 0"));
  EXPECT_THAT(refusal(kInfinity, 1, -1, 2), HasSubstr("mean: inf"));
  EXPECT_THAT(refusal(0, 1, 6, kInfinity),
              HasSubstr("only 9.86588e-10 of the normal's probability lies between lower 6 and "
                        "upper inf; it must be at least 1e-06"));
}

TEST(Correlations, RefusalNamesPairAndRule) {
  const auto refusal = [](const std::vector<Correlation>& correlations) {
    return Refusal(
        Prior::Make({Normal("k", 0, 1), Normal("c", 0, 1), Normal("m", 0, 1)}, correlations)
            .status());
  };
  EXPECT_EQ(refusal({{"k", "c", 0.5}, {"kk", "c", 0.5}}),
            "correlations[1]: unknown parameter \"kk\"; uncertain are k, c, m");
  EXPECT_EQ(refusal({{"k", "k", 0.5}}), "correlations[0]: k cannot be correlated with itself");
  EXPECT_EQ(refusal({{"k", "c", 0.5}, {"c", "k", 0.5}}),
            "correlations[1]: c and k are given twice");
  EXPECT_EQ(refusal({{"k", "c", 1}}),
            "correlations[0]: coefficient 1 of k and c must lie between -1 and 1");
  EXPECT_THAT(refusal({{"k", "c", kNan}}), HasSubstr("coefficient nan"));
  EXPECT_EQ(refusal({{"k", "c", 0.9}, {"c", "m", 0.9}, {"k", "m", -0.9}}),
            "correlations: k and c 0.9, c and m 0.9, k and m -0.9: no parameters can be correlated "
            "like this together; the matrix of the coefficients has the eigenvalue -0.8 and must "
            "be positive definite, with none below 1e-08");
  EXPECT_THAT(refusal({{"k", "c", 1 - 1e-12}}), HasSubstr("positive definite"));
}

}  // namespace
}  // namespace polyest::internal::mapped_prior_test
