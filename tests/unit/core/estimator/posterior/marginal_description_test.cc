#include "core/estimator/posterior/marginal_description.h"

#include <absl/strings/match.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/bayes/identifiability.h"
#include "core/estimator/problem/logarithmic_germs.h"

namespace polyest::internal::marginal_description_test {
namespace {

// A lognormal parameter and a uniform one, whose germ is that of its logarithm.
Prior Mixed() {
  return Prior(ByLogarithms({UncertainParameter::Lognormal("m", 1, 0.4).value(),
                             UncertainParameter::Uniform("k", 20, 60).value()},
                            {}));
}

ParameterEstimate Narrow(const Prior& prior, int i) {
  ParameterEstimate parameter;
  parameter.prior_mean = prior.Mean()[i];
  parameter.prior_std_dev = prior.StandardDeviation()[i];
  parameter.map = parameter.mean = 25;
  parameter.std_dev = parameter.posterior_std_dev = 0.1;
  parameter.verdict = Verdict::kWeak;
  return parameter;
}

// Returns an estimate whose parameters have a correlation of −0.9.
Estimate NarrowEstimate(const Prior& prior) {
  Estimate estimate;
  estimate.parameters = {Narrow(prior, 0), Narrow(prior, 1)};
  estimate.covariance.resize(2, 2);
  estimate.covariance << 0.01, -0.009, -0.009, 0.01;
  estimate.directions = Directions(1e4 * Matrix::Identity(2, 2), prior);
  return estimate;
}

Findings WithPower(double power) {
  Findings findings;
  findings.power = power;
  return findings;
}

TEST(MarginalDescription, IsThePriorWhereTheDataAreNotUsed) {
  const Prior prior = Mixed();
  Estimate estimate = NarrowEstimate(prior);
  GoByPriorIfInaccurate(WithPower(0.009), prior, estimate);
  const ParameterEstimate& k = estimate.parameters[1];
  EXPECT_EQ(k.verdict, Verdict::kNotIdentified);
  EXPECT_EQ(k.mean, k.prior_mean);
  EXPECT_EQ(k.std_dev, k.prior_std_dev);
  EXPECT_EQ(k.posterior_std_dev, k.prior_std_dev);
  EXPECT_NEAR(k.lower95, 21, 1e-9);
  EXPECT_NEAR(k.upper95, 59, 1e-9);
  EXPECT_NEAR(estimate.parameters[0].map, std::exp(prior.parameters()[0].location), 1e-12);
  const Matrix independent = prior.StandardDeviation().cwiseAbs2().asDiagonal();
  EXPECT_EQ(estimate.covariance, independent);
  EXPECT_EQ(estimate.directions[0].information, 0);
  EXPECT_EQ(estimate.directions[0].verdict, Verdict::kNotIdentified);
}

TEST(MarginalDescription, IsThatOfTheDrawsWhereTheDataAreUsed) {
  const Prior prior = Mixed();
  Estimate estimate = NarrowEstimate(prior);
  ParameterEstimate& k = estimate.parameters[1];
  GoByPriorIfInaccurate(WithPower(0.011), prior, estimate);
  EXPECT_EQ(k.verdict, Verdict::kWeak);
  EXPECT_EQ(k.mean, 25);
  k.verdict = Verdict::kNotIdentified;
  GoByPriorIfInaccurate(WithPower(1), prior, estimate);
  EXPECT_EQ(k.mean, 25);
  EXPECT_EQ(estimate.covariance, NarrowEstimate(prior).covariance);
}

// The other parameter keeps its estimate, and their correlation stays.
TEST(MarginalDescription, IsThePriorOfAParameterThatAnInaccurateExpansionDoesNotKnow) {
  const Prior prior = Mixed();
  Estimate estimate = NarrowEstimate(prior);
  ParameterEstimate& k = estimate.parameters[1];
  k.verdict = Verdict::kNotIdentified;
  GoByPriorIfInaccurate(WithPower(0.5), prior, estimate);
  EXPECT_EQ(k.mean, k.prior_mean);
  EXPECT_EQ(k.map, 25);
  EXPECT_EQ(estimate.parameters[0].mean, 25);
  EXPECT_EQ(estimate.covariance(0, 0), 0.01);
  EXPECT_NEAR(std::sqrt(estimate.covariance(1, 1)), k.prior_std_dev, 1e-12);
  EXPECT_NEAR(estimate.covariance(1, 0), -0.9 * 0.1 * k.prior_std_dev, 1e-12);
}

TEST(MarginalDescription, IsRefusedIfItIsNotFinite) {
  const Prior prior = Mixed();
  const std::vector<ParameterEstimate> finite = {Narrow(prior, 0), Narrow(prior, 1)};
  EXPECT_TRUE(CheckFinite(finite).ok());
  for (double ParameterEstimate::*number :
       {&ParameterEstimate::map, &ParameterEstimate::std_dev, &ParameterEstimate::mean,
        &ParameterEstimate::posterior_std_dev, &ParameterEstimate::lower95,
        &ParameterEstimate::upper95, &ParameterEstimate::contraction}) {
    for (const double value : {std::nan(""), kInfinity}) {
      std::vector<ParameterEstimate> parameters = finite;
      parameters[1].name = "k";
      parameters[1].*number = value;
      const absl::Status status = CheckFinite(parameters);
      EXPECT_TRUE(absl::IsFailedPrecondition(status));
      EXPECT_TRUE(absl::StartsWith(status.message(), "the estimate of k is not finite")) << status;
    }
  }
}

// Chains that have not mixed may be as wrong as an expansion that the model contradicts.
TEST(Findings, DoubtEveryParameterWhereChainsHaveNotMixed) {
  Findings findings;
  findings.windows.doubtful = {false, false};
  EXPECT_FALSE(findings.IsDoubtful(0));
  findings.not_mixed = "R̂ is 1.200";
  EXPECT_TRUE(findings.IsDoubtful(0));
  EXPECT_TRUE(findings.IsDoubtful(1));
}

}  // namespace
}  // namespace polyest::internal::marginal_description_test
