#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/convert/estimate.h"

namespace polyest::internal {
namespace {

Estimate TwoParameters() {
  Estimate estimate;
  estimate.parameters = {{.name = "k",
                          .unit = "N/m",
                          .map = 1,
                          .std_dev = 2,
                          .robust_std_dev = 2.5,
                          .mean = 3,
                          .lower95 = 4,
                          .upper95 = 5,
                          .posterior_std_dev = 8,
                          .prior_mean = 6,
                          .prior_std_dev = 7,
                          .contraction = 0.5,
                          .bias = -0.5,
                          .verdict = Verdict::kIdentified},
                         {.name = "c", .unit = "N s/m", .verdict = Verdict::kWeak}};
  estimate.covariance = (Matrix(2, 2) << 1, 2, 3, 4).finished();
  estimate.cost = {.mismatch = 10, .prior = 20, .total = 30};
  estimate.regularization = 0.25;
  estimate.channels = {{.output = "x",
                        .samples = 8,
                        .chi_squared = 9,
                        .noise_std_dev = 0.1,
                        .noise_time_constant_s = 12,
                        .noise_white_share = 0.75}};
  estimate.directions = {{.information = 11,
                          .coefficients = (Vector(2) << 0.6, 0.8).finished(),
                          .verdict = Verdict::kNotIdentified}};
  estimate.expansion = {.order = 3,
                        .terms = 10,
                        .points = 20,
                        .residual_to_noise = 0.02,
                        .pareto_shape = 0.25,
                        .reexpansions = 1,
                        .trajectories = 40};
  estimate.disagreement = 1.25;
  estimate.windows = {{.first_run = 1,
                       .last_run = 2,
                       .start_s = 3,
                       .end_s = 4,
                       .parameters = {{.parameter = 1, .value = 5, .std_dev = 6}}}};
  estimate.time_s = 12;
  estimate.samples = 13;
  return estimate;
}

TEST(EstimateToProto, CarriesThePiecesOfAPosterior) {
  Estimate estimate = TwoParameters();
  EXPECT_EQ(ToProto(estimate).components_size(), 0);
  estimate.components = {{.weight = 0.75, .parameters = estimate.parameters},
                         {.weight = 0.25, .parameters = estimate.parameters}};
  estimate.components[1].parameters[0].map = -1;
  const v1::Estimate proto = ToProto(estimate);
  ASSERT_EQ(proto.components_size(), 2);
  EXPECT_EQ(proto.components(0).weight(), 0.75);
  EXPECT_EQ(proto.components(1).weight(), 0.25);
  ASSERT_EQ(proto.components(1).parameters_size(), 2);
  EXPECT_EQ(proto.components(1).parameters(0).name(), "k");
  EXPECT_EQ(proto.components(1).parameters(0).map(), -1);
}

TEST(EstimateToProto, CarriesParametersAndCovarianceRowMajor) {
  const v1::Estimate proto = ToProto(TwoParameters());
  ASSERT_EQ(proto.parameters_size(), 2);
  const v1::ParameterEstimate& k = proto.parameters(0);
  EXPECT_EQ(k.name(), "k");
  EXPECT_EQ(k.unit(), "N/m");
  EXPECT_EQ(k.map(), 1);
  EXPECT_EQ(k.std_dev(), 2);
  EXPECT_EQ(k.robust_std_dev(), 2.5);
  EXPECT_EQ(k.mean(), 3);
  EXPECT_EQ(k.lower95(), 4);
  EXPECT_EQ(k.upper95(), 5);
  EXPECT_EQ(k.posterior_std_dev(), 8);
  EXPECT_EQ(k.prior_mean(), 6);
  EXPECT_EQ(k.prior_std_dev(), 7);
  EXPECT_EQ(k.contraction(), 0.5);
  EXPECT_EQ(k.bias(), -0.5);
  EXPECT_EQ(k.verdict(), v1::Identifiability::IDENTIFIED);
  EXPECT_EQ(proto.parameters(1).verdict(), v1::Identifiability::WEAK);
  ASSERT_EQ(proto.covariance_size(), 4);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(proto.covariance(i), i + 1);
}

TEST(EstimateToProto, CarriesEverythingElse) {
  const v1::Estimate proto = ToProto(TwoParameters());
  EXPECT_EQ(proto.cost().mismatch(), 10);
  EXPECT_EQ(proto.cost().prior(), 20);
  EXPECT_EQ(proto.cost().total(), 30);
  EXPECT_EQ(proto.regularization(), 0.25);
  ASSERT_EQ(proto.channels_size(), 1);
  EXPECT_EQ(proto.channels(0).output(), "x");
  EXPECT_EQ(proto.channels(0).samples(), 8);
  EXPECT_EQ(proto.channels(0).chi_squared(), 9);
  EXPECT_EQ(proto.channels(0).noise_std_dev(), 0.1);
  EXPECT_EQ(proto.channels(0).noise_time_constant_s(), 12);
  EXPECT_EQ(proto.channels(0).noise_white_share(), 0.75);
  ASSERT_EQ(proto.directions_size(), 1);
  EXPECT_EQ(proto.directions(0).information(), 11);
  ASSERT_EQ(proto.directions(0).coefficients_size(), 2);
  EXPECT_EQ(proto.directions(0).coefficients(0).parameter(), "k");
  EXPECT_EQ(proto.directions(0).coefficients(0).value(), 0.6);
  EXPECT_EQ(proto.directions(0).coefficients(1).parameter(), "c");
  EXPECT_EQ(proto.directions(0).coefficients(1).value(), 0.8);
  EXPECT_EQ(proto.directions(0).verdict(), v1::Identifiability::NOT_IDENTIFIED);
  EXPECT_EQ(proto.expansion().order(), 3);
  EXPECT_EQ(proto.expansion().terms(), 10);
  EXPECT_EQ(proto.expansion().points(), 20);
  EXPECT_EQ(proto.expansion().residual_to_noise(), 0.02);
  EXPECT_EQ(proto.expansion().reexpansions(), 1);
  EXPECT_EQ(proto.expansion().trajectories(), 40);
  EXPECT_EQ(proto.expansion().pareto_shape(), 0.25);
  EXPECT_EQ(proto.time(), 12);
  EXPECT_EQ(proto.samples(), 13);
  EXPECT_EQ(proto.sequence(), 0);
}

TEST(EstimateToProto, CarriesTheWindowsOfARecord) {
  const v1::Estimate proto = ToProto(TwoParameters());
  EXPECT_EQ(proto.disagreement(), 1.25);
  ASSERT_EQ(proto.windows_size(), 1);
  const v1::WindowEstimate& window = proto.windows(0);
  EXPECT_EQ(window.first_run(), 1);
  EXPECT_EQ(window.last_run(), 2);
  EXPECT_EQ(window.start_time_s(), 3);
  EXPECT_EQ(window.end_time_s(), 4);
  ASSERT_EQ(window.values_size(), 1);
  EXPECT_EQ(window.values(0).parameter(), "c");
  EXPECT_EQ(window.values(0).value(), 5);
  EXPECT_EQ(window.values(0).std_dev(), 6);
}

TEST(EstimateToProto, KeepsWhatDriftsInAHistory) {
  Estimate estimate = TwoParameters();
  const std::string name = estimate.parameters[0].name;
  estimate.filtered = {
      {.name = "x", .unit = "m", .mean = 1, .std_dev = 0.1, .lower95 = 0.8, .upper95 = 1.2},
      {.name = name, .unit = "N/m", .mean = 40, .std_dev = 2, .lower95 = 36, .upper95 = 44}};
  const v1::EstimateHistory::Point point = ToHistoryPoint(ToProto(estimate));
  ASSERT_EQ(point.drifting_size(), 1);  // x is a state
  const v1::EstimateHistory::Parameter& drifting = point.drifting(0);
  EXPECT_EQ(drifting.name(), name);
  EXPECT_EQ(drifting.unit(), "N/m");
  EXPECT_EQ(drifting.mean(), 40);
  EXPECT_EQ(drifting.std_dev(), 2);
  EXPECT_EQ(drifting.lower95(), 36);
  EXPECT_EQ(drifting.upper95(), 44);
}

TEST(EstimateToProto, KeepsWarningsAndReexpansionsInAHistory) {
  Estimate estimate = TwoParameters();
  estimate.expansion.reexpansions = 3;
  estimate.diagnostics = {{DiagnosticCode::kModelMisfit, "output x"},
                          {DiagnosticCode::kNonGaussian, "c"},
                          {DiagnosticCode::kModelMisfit, "output y"}};
  const v1::EstimateHistory::Point point = ToHistoryPoint(ToProto(estimate));
  EXPECT_EQ(point.reexpansion_count(), 3);
  EXPECT_THAT(point.warnings(),
              testing::ElementsAre(v1::Diagnostic::MODEL_MISFIT, v1::Diagnostic::NON_GAUSSIAN));
}

TEST(EstimateToProto, KnowsEveryDiagnostic) {
  const std::pair<DiagnosticCode, v1::Diagnostic::Code> codes[] = {
      {DiagnosticCode::kNotIdentified, v1::Diagnostic::NOT_IDENTIFIED},
      {DiagnosticCode::kUndersampled, v1::Diagnostic::UNDERSAMPLED},
      {DiagnosticCode::kExpansionInaccurate, v1::Diagnostic::EXPANSION_INACCURATE},
      {DiagnosticCode::kModelMisfit, v1::Diagnostic::MODEL_MISFIT},
      {DiagnosticCode::kAtPriorBound, v1::Diagnostic::AT_PRIOR_BOUND},
      {DiagnosticCode::kMultipleMinima, v1::Diagnostic::MULTIPLE_MINIMA},
      {DiagnosticCode::kNotConverged, v1::Diagnostic::NOT_CONVERGED},
      {DiagnosticCode::kPointsFailed, v1::Diagnostic::POINTS_FAILED},
      {DiagnosticCode::kNonGaussian, v1::Diagnostic::NON_GAUSSIAN},
      {DiagnosticCode::kCorrelatedResiduals, v1::Diagnostic::CORRELATED_RESIDUALS},
      {DiagnosticCode::kNoiseNotLearned, v1::Diagnostic::NOISE_NOT_LEARNED},
      {DiagnosticCode::kRegularizationNotDetermined, v1::Diagnostic::REGULARIZATION_NOT_DETERMINED},
      {DiagnosticCode::kSuspiciousData, v1::Diagnostic::SUSPICIOUS_DATA},
      {DiagnosticCode::kInconsistentOverTime, v1::Diagnostic::INCONSISTENT_OVER_TIME},
      {DiagnosticCode::kReplayPostponed, v1::Diagnostic::REPLAY_POSTPONED},
      {DiagnosticCode::kWindowsDisagree, v1::Diagnostic::WINDOWS_DISAGREE},
      {DiagnosticCode::kPriorDataConflict, v1::Diagnostic::PRIOR_DATA_CONFLICT},
      {DiagnosticCode::kFixedValueConflict, v1::Diagnostic::FIXED_VALUE_CONFLICT}};
  for (const auto& [code, expected] : codes) {
    Estimate estimate;
    estimate.diagnostics = {{code, "why"}};
    const v1::Estimate proto = ToProto(estimate);
    EXPECT_EQ(proto.diagnostics(0).code(), expected);
    EXPECT_EQ(NameOf(code), v1::Diagnostic::Code_Name(expected));
    EXPECT_EQ(proto.diagnostics(0).message(), "why");
  }
}

}  // namespace
}  // namespace polyest::internal
