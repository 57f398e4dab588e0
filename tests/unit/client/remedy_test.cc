// Tests the remedies that `polyest explain` tries: what is tried, and what it makes of a problem.

#include "client/cli/remedy.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>

#include "client/cli/remedy_trial.h"

namespace polyest::internal::remedy_test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

template <typename Message>
Message FromText(const std::string& json) {
  Message message;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(json, &message).ok()) << json;
  return message;
}

v1::Problem Oscillator() {
  return FromText<v1::Problem>(R"({
    "model": {"builtin": "mass_spring_damper"},
    "uncertain": [{"name": "k", "normal": {"mean": 40, "stdDev": 4}},
                  {"name": "v0", "normal": {"mean": 0, "stdDev": 1}, "perRun": true}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  })");
}

v1::Estimate WithChiSquared(double chi_squared) {
  v1::Estimate estimate;
  v1::ParameterEstimate& k = *estimate.add_parameters();
  k.set_name("k");
  k.set_prior_std_dev(4);
  v1::ChannelEstimate& channel = *estimate.add_channels();
  channel.set_output("x");
  channel.set_samples(100);
  channel.set_chi_squared(chi_squared);
  return estimate;
}

std::vector<Remedy> ListFor(const v1::Problem& problem, double chi_squared = 400) {
  return ListRemedies(problem, WithChiSquared(chi_squared), {{"x", false, 1}, {"v", true, 2}}, 100);
}

std::vector<std::string> Texts(const std::vector<Remedy>& remedies) {
  std::vector<std::string> texts;
  for (const Remedy& remedy : remedies) texts.push_back(RemedyText(remedy));
  return texts;
}

TEST(RemedyTest, NoiseComesFirstThenVelocitiesAndDriftThenOtherStates) {
  EXPECT_THAT(Texts(ListFor(Oscillator())),
              ElementsAre("correlated noise of x", "larger noise of x", "process noise on v",
                          "drift of k", "process noise on x"));
}

TEST(RemedyTest, NoiseIsNotEnlargedWhereResidualsAreAsLargeAsStated) {
  EXPECT_THAT(Texts(ListFor(Oscillator(), 100)),
              ElementsAre("correlated noise of x", "process noise on v", "drift of k",
                          "process noise on x"));
}

TEST(RemedyTest, WhatAProblemHasAlreadyIsNotTried) {
  v1::Problem problem = Oscillator();
  problem.mutable_measured(0)->mutable_noise()->mutable_correlation()->set_auto_(true);
  problem.mutable_uncertain(0)->mutable_drift()->mutable_random_walk()->set_unknown(true);
  problem.add_process_noise()->set_state("v");
  EXPECT_THAT(Texts(ListFor(problem, 100)), ElementsAre("process noise on x"));
}

TEST(RemedyTest, NothingMovesInARecordWithoutDuration) {
  EXPECT_THAT(Texts(ListRemedies(Oscillator(), WithChiSquared(100), {{"v", true, 2}}, 0)),
              ElementsAre("correlated noise of x"));
}

TEST(RemedyTest, SizesComeFromTheSpreadAndThePrior) {
  const std::vector<Remedy> remedies = ListFor(Oscillator());
  EXPECT_THAT(remedies[1].sizes, ElementsAre(0.02));              // 0.01 √4
  EXPECT_THAT(remedies[2].sizes, ElementsAre(4e-4, 0.04, 4e-6));  // of 2²/100
  EXPECT_THAT(remedies[3].sizes, ElementsAre(0.04, 0.4, 0.004));  // of 4/√100
}

TEST(RemedyTest, CorrelatedNoiseHasTheSizeOfTheResiduals) {
  const Remedy remedy = ListFor(Oscillator())[0];
  const v1::Problem problem = WithKnownSize(Oscillator(), remedy, 0);
  EXPECT_TRUE(problem.measured(0).noise().correlation().auto_());
  EXPECT_EQ(problem.measured(0).noise().absolute(), 0.02);
}

TEST(RemedyTest, AnUnknownSizeLiesBetweenBoundsAroundTheKnownOne) {
  const Remedy remedy = ListFor(Oscillator())[2];
  EXPECT_EQ(WithKnownSize(Oscillator(), remedy, 0.03).process_noise(0).spectral_density(), 0.03);
  EXPECT_THAT(
      RemedyJson(WithUnknownSize(Oscillator(), remedy, 0.03), remedy),
      ElementsAre(R"("processNoise": [{"state":"v","unknown":true,"lower":0.001,"upper":0.9}])"));
}

TEST(RemedyTest, AnExplicitLikelihoodGivesWay) {
  v1::Problem problem = Oscillator();
  problem.set_likelihood(v1::Problem::OUTPUT_ERROR);
  const Remedy remedy = ListFor(problem)[3];
  const std::vector<std::string> json = RemedyJson(WithUnknownSize(problem, remedy, 0.6), remedy);
  EXPECT_THAT(
      json,
      ElementsAre(HasSubstr(R"("drift":{"randomWalk":{"unknown":true,"lower":0.1,"upper":4}})"),
                  R"("likelihood": "PREDICTION_ERROR")"));
}

TEST(RemedyTest, LargerNoiseIsAParameterWithItsOwnPrior) {
  const Remedy remedy = ListFor(Oscillator())[1];
  EXPECT_THAT(
      RemedyJson(WithKnownSize(Oscillator(), remedy, 0), remedy),
      ElementsAre(HasSubstr(R"({"name":"x.noise","lognormal":{"mean":0.02,"stdDev":0.02}})"),
                  R"("likelihood": "PREDICTION_ERROR")"));
}

TEST(RemedyTest, ResidualsThatAreOnlyTooSmallCallForNone) {
  v1::Estimate estimate = WithChiSquared(30);
  EXPECT_FALSE(CallsForRemedies(Oscillator(), estimate));
  estimate.add_diagnostics()->set_code(v1::Diagnostic::MODEL_MISFIT);
  EXPECT_FALSE(CallsForRemedies(Oscillator(), estimate));
  estimate.mutable_channels(0)->set_chi_squared(200);
  EXPECT_TRUE(CallsForRemedies(Oscillator(), estimate));
}

TEST(RemedyTest, FiltersThatHandleOutliersLeaveResidualsSmallerByThemselves) {
  v1::Estimate estimate = WithChiSquared(60);  // Gaussian noise of the stated size leaves as much
  estimate.add_diagnostics()->set_code(v1::Diagnostic::CORRELATED_RESIDUALS);
  v1::Problem problem = Oscillator();
  problem.mutable_measured(0)->mutable_noise()->set_outliers(v1::MeasuredOutput::Noise::STUDENT_T);
  EXPECT_FALSE(CallsForRemedies(problem, estimate));
  problem.set_likelihood(v1::Problem::PREDICTION_ERROR);
  EXPECT_TRUE(CallsForRemedies(problem, estimate));
  estimate.mutable_channels(0)->set_chi_squared(39);
  EXPECT_FALSE(CallsForRemedies(problem, estimate));
}

TEST(RemedyTest, NoiseWithOutliersIsLargerFromAnotherSizeOn) {
  v1::Problem problem = Oscillator();
  EXPECT_THAT(Texts(ListFor(problem, 140)), Contains("larger noise of x"));
  problem.mutable_measured(0)->mutable_noise()->set_outliers(v1::MeasuredOutput::Noise::STUDENT_T);
  EXPECT_THAT(Texts(ListFor(problem, 140)), Not(Contains("larger noise of x")));
  EXPECT_THAT(Texts(ListFor(problem, 160)), Contains("larger noise of x"));
}

TEST(RemedyTest, AProblemThatMeasuresNothingHasNoRemedy) {
  EXPECT_THAT(ListRemedies(v1::Problem(), v1::Estimate(), {}, 10), IsEmpty());
}

}  // namespace
}  // namespace polyest::internal::remedy_test
