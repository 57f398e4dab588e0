// Tests parameters of runs that share a population, against the exact posterior.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/testing/population.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const ParameterEstimate& Named(const Estimate& estimate, const std::string& name) {
  return *std::ranges::find(estimate.parameters, name, &ParameterEstimate::name);
}

void ExpectMoments(const ParameterEstimate& parameter, const Moments& exact) {
  SCOPED_TRACE(parameter.name);
  EXPECT_NEAR(parameter.mean, exact.mean(), 0.1 * exact.deviation());
  EXPECT_NEAR(parameter.posterior_std_dev, exact.deviation(), 0.05 * exact.deviation());
}

void ExpectAgreement(const PopulationCampaign& campaign, const Samples& samples) {
  const int runs = samples.run.back() + 1;
  const Estimate estimate = EstimateOf(campaign.MakeProblem(), samples);
  const PopulationOracle exact(campaign, samples);
  SCOPED_TRACE(runs);
  ExpectMoments(Named(estimate, "v.mean"), exact.mean);
  ExpectMoments(Named(estimate, "v.spread"), exact.spread);
  ExpectMoments(Named(estimate, "b"), exact.offset);
  ExpectMoments(Named(estimate, absl::StrCat("v[", runs - 1, "]")), exact.last);
}

TEST(Populations, OfPreciseRunsAgreeWithTheExactPosterior) {
  const PopulationCampaign precise{.noise = 0.05};
  for (const int runs : {1, 2, 3, 10, 40}) ExpectAgreement(precise, precise.MakeRuns(runs, 1));
}

// Each run alone tells less of its slope than the population does.
TEST(Populations, OfVagueRunsAgreeWithTheExactPosterior) {
  const PopulationCampaign vague{.noise = 1};
  for (const int runs : {3, 10, 40}) ExpectAgreement(vague, vague.MakeRuns(runs, 2));
}

// What is known of runs that have ended is tempered together with the rest of the likelihood where
// there are few samples: without it, the cost would have no lower bound.
TEST(Populations, OfRunsOfOneSampleAgreeWithTheExactPosterior) {
  const PopulationCampaign campaign{.noise = 0.3};
  for (const uint64_t seed : {1, 4, 5, 6}) {
    SCOPED_TRACE(seed);
    ExpectAgreement(campaign, campaign.MakeShortRuns(5, seed));
  }
}

TEST(Populations, AddTwoParameters) {
  const PopulationCampaign campaign;
  const Estimate estimate = EstimateOf(campaign.MakeProblem(), campaign.MakeRuns(3));
  std::vector<std::string> names;
  for (const ParameterEstimate& parameter : estimate.parameters) names.push_back(parameter.name);
  EXPECT_THAT(names, ElementsAre("v[2]", "b", "v.mean", "v.spread"));
  EXPECT_DOUBLE_EQ(Named(estimate, "v.mean").prior_std_dev, 1);
  EXPECT_NEAR(estimate.cost.total, estimate.cost.mismatch + estimate.cost.prior, 1e-9);
}

// The population of another prior is one of its normal scores: this one's are those of log v.
TEST(Populations, OfALognormalPriorAreOfLogarithms) {
  const PopulationCampaign campaign;
  Problem problem = campaign.MakeProblem();
  problem.uncertain[0] = UncertainParameter::Lognormal("v", 5.5, 1).value();
  problem.uncertain[0].per_run = problem.uncertain[0].population = true;
  const Estimate estimate = EstimateOf(problem, campaign.MakeRuns(30));
  // To a coefficient of variation of 6 % a lognormal is a normal, to a hundredth of its mean.
  EXPECT_NEAR(Named(estimate, "v.median").mean, 5, 3 * 0.3 / std::sqrt(30.0) + 0.05);
  EXPECT_NEAR(Named(estimate, "v.spread").mean, 0.06, 0.03);
}

TEST(Populations, OfAUniformPriorStayWithinIt) {
  const PopulationCampaign campaign;
  Problem problem = campaign.MakeProblem();
  problem.uncertain[0] = UncertainParameter::Uniform("v", 3, 7).value();
  problem.uncertain[0].per_run = problem.uncertain[0].population = true;
  const Samples samples = campaign.MakeRuns(8);
  const Estimate estimate = EstimateOf(problem, samples);
  const PopulationOracle close(campaign, samples);
  EXPECT_NEAR(Named(estimate, "v.median").mean, close.mean.mean(), 0.3 * close.mean.deviation());
  EXPECT_NEAR(Named(estimate, "v[7]").mean, close.last.mean(), 0.3 * close.last.deviation());
}

TEST(Populations, HowTheirRecordIsCutIntoBatchesDoesNotMatter) {
  const PopulationCampaign campaign;
  const Samples all = campaign.MakeRuns(5);
  EstimatorOptions options;
  options.threads = 2;
  const auto estimator = MakeEstimator(campaign.MakeProblem(), options);
  for (size_t first = 0; first < all.rows(); first += 3) {
    ASSERT_TRUE(estimator->Append(testing::Rows(all, first, 3)).ok());
    ASSERT_TRUE(estimator->Process().ok());
    ASSERT_TRUE(estimator->CurrentEstimate().ok());
  }
  ExpectSame(estimator->CurrentEstimate().value(), EstimateOf(campaign.MakeProblem(), all));
}

TEST(Populations, GoOnFromASnapshotToTheSameBits) {
  const PopulationCampaign campaign;
  Problem problem = campaign.MakeProblem();
  problem.integration.samples_between_checkpoints = 10;
  const Samples all = campaign.MakeRuns(9);
  EstimatorSnapshot last;
  EstimatorOptions options;
  options.snapshot = [&last](EstimatorSnapshot snapshot) { last = std::move(snapshot); };
  const auto first = MakeEstimator(problem, options);
  ASSERT_TRUE(first->Append(testing::Rows(all, 0, 28)).ok());
  ASSERT_TRUE(first->Process().ok());
  ASSERT_EQ(last.rows, 24);
  const auto second = MakeEstimator(problem);
  ASSERT_TRUE(second->Append(all).ok());
  ASSERT_TRUE(second->Restore(last).ok());
  EXPECT_EQ(second->rows_processed(), 24);
  ASSERT_TRUE(second->Process().ok());
  ExpectSame(second->CurrentEstimate().value(), EstimateOf(problem, all));
  // A snapshot of the same runs without a population does not fit.
  problem.uncertain[0].population = false;
  const auto other = MakeEstimator(problem);
  ASSERT_TRUE(other->Append(all).ok());
  EXPECT_FALSE(other->Restore(last).ok());
}

// Ended runs are predicted with what the population says of them, too: vague runs are drawn closer
// to their common mean than each would be alone.
TEST(Populations, PredictEndedRuns) {
  const PopulationCampaign campaign{.noise = 0.5};
  const auto estimator = MakeEstimator(campaign.MakeProblem());
  ASSERT_TRUE(estimator->Append(campaign.MakeRuns(12)).ok());
  ASSERT_TRUE(estimator->Process().ok());
  const auto prediction = estimator->CurrentPrediction({});
  ASSERT_TRUE(prediction.ok()) << prediction.status();
  const Vector& residuals = prediction->outputs[0].standardized_residual;
  EXPECT_NEAR(std::sqrt(residuals.squaredNorm() / static_cast<double>(residuals.size())), 1, 0.25);
}

std::string RefusalOf(const Problem& problem) {
  return std::string(Estimator::Make(problem, {}).status().message());
}

TEST(Populations, RefuseWhatTheyCannotBe) {
  const Problem valid = PopulationCampaign().MakeProblem();
  ASSERT_EQ(RefusalOf(valid), "");
  Problem problem = valid;
  problem.uncertain[0].per_run = false;
  EXPECT_THAT(RefusalOf(problem), HasSubstr("uncertain[0].population: v needs perRun"));
  problem = valid;
  problem.uncertain[1].per_run = problem.uncertain[1].population = true;
  EXPECT_THAT(RefusalOf(problem), HasSubstr("uncertain[1].population: v has one already"));
  problem = valid;
  problem.expansion.adaptive = false;
  EXPECT_THAT(RefusalOf(problem), HasSubstr("expansion.adaptive: false"));
  problem = valid;
  problem.regularization = 2;
  EXPECT_THAT(RefusalOf(problem), HasSubstr("regularization: must be 1"));
  problem = valid;
  problem.correlations = {{"v", "b", 0.5}};
  EXPECT_THAT(RefusalOf(problem), HasSubstr("correlations[0]"));
}

}  // namespace
}  // namespace polyest::internal
