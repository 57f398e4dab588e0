// Tests how `polyest explain` tries remedies, by a backend that answers from a table.

#include "client/cli/remedy_trial.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/unit/client/table_backend.h"

namespace polyest::internal::remedy_trial_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

constexpr double kUntreated = -1000;  // log evidence

v1::Estimate EstimateOf(const v1::Experiment& experiment) {
  v1::Estimate estimate;
  for (const v1::UncertainParameter& uncertain : experiment.problem().uncertain()) {
    v1::ParameterEstimate& parameter = *estimate.add_parameters();
    parameter.set_name(uncertain.name());
    parameter.set_prior_std_dev(1);
  }
  v1::ChannelEstimate& channel = *estimate.add_channels();
  channel.set_output("x");
  channel.set_samples(10);
  channel.set_chi_squared(10);
  return estimate;
}

bool IsCorrelated(const v1::Problem& problem) {
  return problem.measured(0).noise().has_correlation();
}
bool Drifts(const v1::Problem& problem) { return problem.uncertain(0).has_drift(); }

// Process noise on v explains the record best, the more the larger of the sizes tried, and then the
// noise's correlation.
absl::StatusOr<double> Weight(const v1::Problem& problem) {
  if (IsCorrelated(problem)) return kUntreated + 40;
  if (Drifts(problem)) return kUntreated + 1;
  if (problem.process_noise_size() == 0) return kUntreated;
  const v1::ProcessNoise& noise = problem.process_noise(0);
  if (noise.state() == "x") return kUntreated + 2;
  if (noise.unknown()) return kUntreated + 90;
  return kUntreated + 100 + 10 * std::log10(noise.spectral_density());
}

std::vector<std::string> Tried(const RemedyTrial& trial) {
  std::vector<std::string> texts;
  for (const TriedRemedy& one : trial.tried) texts.push_back(RemedyText(one.remedy));
  return texts;
}

RemedyTrial TrialOf(TableBackend& backend, const v1::Experiment& experiment = Oscillator()) {
  return TryRemedies(experiment, EstimateOf(experiment), backend).value();
}

TEST(RemedyTrialTest, TheRemedyOfTheHighestEvidenceComesFirstAndItsSizeIsEstimated) {
  TableBackend backend(Weight);
  const RemedyTrial trial = TrialOf(backend);
  EXPECT_THAT(Tried(trial), ElementsAre("process noise on v", "correlated noise of x",
                                        "process noise on x", "drift of k"));
  // That of the estimated size, although it has less evidence than the best size tried.
  EXPECT_EQ(trial.tried[0].gain, 90);
  EXPECT_TRUE(trial.tried[0].problem.process_noise(0).unknown());
  EXPECT_TRUE(trial.ended.ok() && trial.refusal.ok());
  EXPECT_THAT(trial.refused, IsEmpty());
}

TEST(RemedyTrialTest, TheTwoBestAreScoredBesideTheProblemAsItIs) {
  TableBackend backend(Weight);
  const RemedyTrial trial = TrialOf(backend);
  EXPECT_THAT(backend.scored(), SizeIs(3));
  EXPECT_EQ(trial.untreated.held_out, 3);
  EXPECT_NEAR(trial.untreated.log_score, kUntreated / 10, 1e-9);
  EXPECT_TRUE(trial.tried[0].scored && trial.tried[1].scored);
  EXPECT_FALSE(trial.tried[2].scored);
  EXPECT_NEAR(trial.tried[1].assessment.log_score, (kUntreated + 40) / 10, 1e-9);
}

TEST(RemedyTrialTest, RefusedRemediesAreNamedAndTheOthersTried) {
  TableBackend backend([](const v1::Problem& problem) -> absl::StatusOr<double> {
    if (IsCorrelated(problem)) return absl::InvalidArgumentError("no correlation");
    return Weight(problem);
  });
  const RemedyTrial trial = TrialOf(backend);
  ASSERT_THAT(trial.refused, SizeIs(1));
  EXPECT_EQ(RemedyText(trial.refused[0].remedy), "correlated noise of x");
  EXPECT_EQ(trial.refused[0].refusal.message(), "no correlation");
  EXPECT_THAT(Tried(trial), ElementsAre("process noise on v", "process noise on x", "drift of k"));
}

TEST(RemedyTrialTest, WhatHasBeenTriedIsKeptWhenTheTimeIsOver) {
  TableBackend backend([](const v1::Problem& problem) -> absl::StatusOr<double> {
    if (Drifts(problem)) return absl::DeadlineExceededError("no time left");
    return Weight(problem);
  });
  const RemedyTrial trial = TrialOf(backend);
  EXPECT_TRUE(absl::IsDeadlineExceeded(trial.ended));
  EXPECT_THAT(Tried(trial), ElementsAre("process noise on v", "correlated noise of x"));
  EXPECT_THAT(backend.scored(), IsEmpty());
}

TEST(RemedyTrialTest, AnErrorBeforeTheFirstRemedyIsTheTrials) {
  TableBackend backend([](const v1::Problem& problem) -> absl::StatusOr<double> {
    if (IsCorrelated(problem)) return absl::UnavailableError("gone");
    return Weight(problem);
  });
  const v1::Experiment experiment = Oscillator();
  EXPECT_TRUE(
      absl::IsUnavailable(TryRemedies(experiment, EstimateOf(experiment), backend).status()));
}

TEST(RemedyTrialTest, NothingIsTriedWhereTheProblemItselfCannotBeWeighed) {
  TableBackend refused([](const v1::Problem&) { return absl::InvalidArgumentError("no"); });
  const RemedyTrial without = TrialOf(refused);
  EXPECT_TRUE(absl::IsInvalidArgument(without.refusal));
  EXPECT_THAT(without.tried, IsEmpty());
  TableBackend unweighed([](const v1::Problem&) { return std::nan(""); });
  EXPECT_THAT(TrialOf(unweighed).tried, IsEmpty());
}

TEST(RemedyTrialTest, ARefusedScoreLeavesTheEvidence) {
  TableBackend backend(Weight);
  backend.RefuseScores(absl::FailedPreconditionError("too few rows"));
  const RemedyTrial trial = TrialOf(backend);
  EXPECT_TRUE(trial.ended.ok());
  EXPECT_EQ(trial.tried[0].gain, 90);
  EXPECT_FALSE(trial.tried[0].scored);
}

TEST(RemedyTrialTest, AtMostEightAreTriedAndTheOthersNamed) {
  TableBackend backend(Weight);
  const RemedyTrial trial = TrialOf(backend, Oscillator(/*parameters=*/7));
  EXPECT_THAT(trial.tried, SizeIs(8));
  std::vector<std::string> left_out;
  for (const Remedy& remedy : trial.left_out) left_out.push_back(RemedyText(remedy));
  EXPECT_THAT(left_out, UnorderedElementsAre("drift of p5", "drift of p6", "process noise on x"));
}

}  // namespace
}  // namespace polyest::internal::remedy_trial_test
