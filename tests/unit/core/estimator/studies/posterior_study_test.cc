#include "core/estimator/studies/posterior_study.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/estimator/posterior/posterior_draws.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::SizeIs;

// Measures y = a + 2b = 1.5 ± 0.3 with standard normal priors. The posterior is the Gaussian of
// precision I + hhᵀ/σ².
struct Linear {
  Eigen::Vector2d h{1, 2};
  double z = 1.5, noise = 0.3;
  Eigen::Matrix2d covariance =
      (Eigen::Matrix2d::Identity() + h * h.transpose() / (noise * noise)).inverse();
  Eigen::Vector2d mean = covariance * h * z / (noise * noise);
  std::unique_ptr<Estimator> estimator =
      Processed(TextProblem("a + 2*b",
                            {UncertainParameter::Normal("a", 0, 1).value(),
                             UncertainParameter::Normal("b", 0, 1).value()},
                            noise),
                {z});
};

TEST(Posterior, OfALinearProblemIsTheClosedForm) {
  const Linear linear;
  PosteriorOptions options;
  options.joints = {{"a", "b"}};
  const Posterior posterior = linear.estimator->CurrentPosterior(options).value();
  EXPECT_EQ(posterior.method, PosteriorMethod::kImportanceSampling);
  EXPECT_GT(posterior.effective_size, 0.5 * static_cast<double>(posterior.draws));
  EXPECT_EQ(posterior.r_hat, 0);
  for (int i = 0; i < 2; ++i) {
    const PosteriorMarginal& marginal = posterior.marginals[static_cast<size_t>(i)];
    const double sd = std::sqrt(linear.covariance(i, i));
    EXPECT_NEAR(marginal.mean, linear.mean[i], 0.005 * sd);
    EXPECT_NEAR(marginal.std_dev, sd, 0.005 * sd);
    EXPECT_NEAR(marginal.quantiles[0], linear.mean[i] - 1.95996 * sd, 0.015 * sd);
    EXPECT_NEAR(marginal.quantiles[1], linear.mean[i], 0.01 * sd);
    EXPECT_NEAR(marginal.quantiles[2], linear.mean[i] + 1.95996 * sd, 0.015 * sd);
    // A bin holds about 65536 · 0.04 · 1.1⁻¹ points. Quasi-random points fill it more evenly than
    // to their √N.
    ASSERT_THAT(marginal.density.value, SizeIs(100));
    for (int k = 0; k < 100; ++k) {
      const double u = (marginal.density.value[k] - linear.mean[i]) / sd;
      EXPECT_NEAR(marginal.density.density[k] * sd, std::exp(-u * u / 2) / std::sqrt(2 * M_PI),
                  0.02);
    }
  }
}

TEST(Posterior, HasAJointDensityWhoseMarginalsAreTheParameters) {
  const Linear linear;
  PosteriorOptions options;
  options.joints = {{"b", "a"}};
  options.joint_bins = 30;
  const Posterior posterior = linear.estimator->CurrentPosterior(options).value();
  ASSERT_THAT(posterior.joints, SizeIs(1));
  const JointDensity& joint = posterior.joints[0].density;
  EXPECT_EQ(posterior.joints[0].first, "b");
  ASSERT_EQ(joint.density.rows(), 30);
  ASSERT_EQ(joint.density.cols(), 30);
  const double cell = (joint.first[1] - joint.first[0]) * (joint.second[1] - joint.second[0]);
  // The joint density leaves out 0.1 % of each parameter.
  EXPECT_NEAR(joint.density.sum() * cell, 1, 0.0025);
  // The density contains the valley a + 2b = 1.5: the covariance of its cells is negative.
  double covariance = 0;
  for (int i = 0; i < 30; ++i) {
    for (int k = 0; k < 30; ++k) {
      covariance += cell * joint.density(i, k) * (joint.first[i] - linear.mean[1]) *
                    (joint.second[k] - linear.mean[0]);
    }
  }
  EXPECT_NEAR(covariance, linear.covariance(0, 1), 0.03 * std::abs(linear.covariance(0, 1)));
}

// The bounds for 10,000 equally weighted samples are four standard errors of a mean and of a
// standard deviation.
TEST(Posterior, GivesOutSamples) {
  const Linear linear;
  PosteriorOptions options;
  options.samples = 10'000;
  const Matrix samples = linear.estimator->CurrentPosterior(options).value().samples;
  ASSERT_EQ(samples.rows(), 10'000);
  ASSERT_EQ(samples.cols(), 2);
  for (int i = 0; i < 2; ++i) {
    const double sd = std::sqrt(linear.covariance(i, i));
    const double mean = samples.col(i).mean();
    EXPECT_NEAR(mean, linear.mean[i], 0.04 * sd);
    EXPECT_NEAR(std::sqrt((samples.col(i).array() - mean).square().mean()), sd, 0.03 * sd);
  }
  const Posterior without = linear.estimator->CurrentPosterior({}).value();
  EXPECT_EQ(without.samples.rows(), 0);
  EXPECT_TRUE(without.sample_chains.empty());
}

TEST(Posterior, AgreesWithTheEstimate) {
  const Linear linear;
  const Estimate estimate = linear.estimator->CurrentEstimate().value();
  const Posterior posterior = linear.estimator->CurrentPosterior({}).value();
  for (size_t i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[i];
    const PosteriorMarginal& marginal = posterior.marginals[i];
    EXPECT_NEAR(parameter.mean, marginal.mean, 0.01 * marginal.std_dev);
    EXPECT_NEAR(parameter.posterior_std_dev, marginal.std_dev, 0.01 * marginal.std_dev);
    EXPECT_NEAR(parameter.posterior_std_dev, parameter.std_dev, 0.01 * marginal.std_dev);
  }
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kNonGaussian));
}

// Uses problems in which the Gaussian of one minimum must not stand for the posterior. Four
// dimensions are too many for a cover.
TEST(Posterior, IsOfMarkovChainsWhereItIsNotNearlyGaussian) {
  std::vector<UncertainParameter> parameters;
  for (const char* name : {"a", "b", "c", "d"}) {
    parameters.push_back(UncertainParameter::Uniform(name, -1, 1).value());
  }
  struct {
    const char* what;
    const char* output;
    double z;
    double noise;
  } const cases[] = {{"two pieces", "a^2", 0.4, 0.02},
                     {"two pieces, one of them negligible in width", "a^2 + 0.001*a", 0.4, 0.02},
                     {"at a bound", "a", 1.3, 0.2},
                     {"no information", "0*a", 0, 1}};
  for (const auto& one : cases) {
    SCOPED_TRACE(one.what);
    const std::string output = absl::StrCat(one.output, " + 0*(b + c + d)");
    const auto estimator = Processed(TextProblem(output, parameters, one.noise), {one.z});
    PosteriorOptions options;
    options.samples = 10;
    const Posterior posterior = estimator->CurrentPosterior(options).value();
    EXPECT_EQ(posterior.method, PosteriorMethod::kMarkovChains);
    EXPECT_EQ(posterior.sample_chains, (std::vector<int>{0, 0, 0, 1, 1, 1, 2, 2, 3, 3}));
    ASSERT_EQ(posterior.samples.rows(), 10);
    EXPECT_LE(posterior.samples.cwiseAbs().maxCoeff(), 1);
    EXPECT_GT(posterior.r_hat, 0.99);
    EXPECT_LT(posterior.r_hat, 1.01);
  }
}

TEST(Estimate, SaysThatItIsNotGaussianAndByHowMuch) {
  const auto estimator =
      Processed(TextProblem("a", {UncertainParameter::Uniform("a", -1, 1).value()}, 0.2), {1.3});
  const Estimate estimate = estimator->CurrentEstimate().value();
  EXPECT_THAT(Message(estimate, DiagnosticCode::kNonGaussian),
              ::testing::HasSubstr("that of a is 0."));
}

TEST(PosteriorDraws, KnowWhyTheirChainsHaveNotMixed) {
  PosteriorDraws draws;
  EXPECT_EQ(WhyNotMixed(draws), "");  // of importance sampling
  draws.effective_size = Vector::Constant(2, 5000);
  draws.r_hat = Vector::Constant(2, 1.005);
  EXPECT_EQ(WhyNotMixed(draws), "");
  draws.r_hat[1] = 1.2;
  EXPECT_THAT(WhyNotMixed(draws), ::testing::HasSubstr("R̂ is 1.200"));
  draws.effective_size[0] = 100;
  EXPECT_THAT(WhyNotMixed(draws), ::testing::HasSubstr("worth 100 independent ones"));
}

TEST(PosteriorOptions, NameFieldValueAndRule) {
  const Prior prior({UncertainParameter::Normal("a", 0, 1).value(),
                     UncertainParameter::Normal("b", 0, 1).value()});
  const auto message = [&](const PosteriorOptions& options) {
    const absl::Status status = Validate(options, prior);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  PosteriorOptions options;
  EXPECT_TRUE(Validate(options, prior).ok());
  options.samples = 100'001;
  EXPECT_EQ(message(options), "samples: 100001 must be from 0 to 100000");
  options = {};
  options.probabilities = {0.5, 1};
  EXPECT_EQ(message(options), "probabilities[1]: 1 must be above 0 and below 1");
  options = {};
  options.probabilities = {NAN};
  EXPECT_EQ(message(options), "probabilities[0]: nan must be above 0 and below 1");
  options = {};
  options.density_bins = 1001;
  EXPECT_EQ(message(options), "density_bins: 1001 must be from 0 to 1000");
  options = {};
  options.joint_bins = 201;
  EXPECT_EQ(message(options), "joint_bins: 201 must be from 1 to 200");
  options = {};
  options.joints = {{"a", "c"}};
  EXPECT_EQ(message(options), "joints[0]: \"c\" is not among the uncertain parameters a, b");
  options.joints = {{"a", "b"}, {"b", "b"}};
  EXPECT_EQ(message(options), "joints[1]: b is given twice; a pair is of two parameters");
}

}  // namespace
}  // namespace polyest::internal
