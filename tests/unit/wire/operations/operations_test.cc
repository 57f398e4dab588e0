#include "proto/wire/operations/operations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "polyest/catalogue.h"
#include "proto/wire/convert/studies.h"
#include "proto/wire/operations/names.h"
#include "proto/wire/operations/pages.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

TEST(Models, ComeInPagesThatHoldEachOnceInOrder) {
  std::vector<std::string> names;
  v1::ListModelsRequest request;
  request.set_page_size(2);
  do {
    const auto page = ListModels(request);
    ASSERT_TRUE(page.ok()) << page.status();
    ASSERT_GE(page->models_size(), 1);
    ASSERT_LE(page->models_size(), 2);
    for (const auto& model : page->models()) names.push_back(model.name());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  std::vector<std::string> expected;
  for (const auto& model : BuiltinModels()) {
    expected.push_back("models/" + model->description().name);
  }
  EXPECT_EQ(names, expected);
}

TEST(Models, AreDescribedInFull) {
  v1::GetModelRequest request;
  request.set_name("models/mass_spring_damper");
  const auto model = GetModel(request);
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ(model->name(), "models/mass_spring_damper");
  EXPECT_FALSE(model->summary().empty());
  EXPECT_FALSE(model->equations().empty());
  EXPECT_FALSE(model->source().empty());
  ASSERT_EQ(model->states_size(), 2);
  ASSERT_EQ(model->parameters_size(), 5);
  EXPECT_EQ(model->parameters(0).name(), "m");
  EXPECT_EQ(model->parameters(0).unit(), "kg");
  EXPECT_FALSE(model->parameters(0).meaning().empty());
  EXPECT_EQ(model->parameters(0).default_value(), 0.1);
  EXPECT_EQ(model->inputs(0).name(), "force");
  EXPECT_EQ(model->outputs(0).name(), "x");
}

TEST(Models, ThatDoNotExistAreNotFound) {
  v1::GetModelRequest request;
  request.set_name("models/rocket");
  EXPECT_EQ(GetModel(request).status().code(), absl::StatusCode::kNotFound);
  request.set_name("rocket");
  EXPECT_EQ(GetModel(request).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(Pages, RefuseNegativeSizesAndUnknownTokens) {
  v1::ListModelsRequest request;
  request.set_page_size(-1);
  EXPECT_EQ(ListModels(request).status().message(), "pageSize: -1 must not be negative");
  request.set_page_size(0);
  request.set_page_token("nowhere");
  EXPECT_EQ(ListModels(request).status().message(),
            "pageToken: \"nowhere\" is not the nextPageToken of a page");
}

TEST(Pages, HaveADefaultSizeAndALargest) {
  EXPECT_EQ(*PageSize(0), 50u);
  EXPECT_EQ(*PageSize(7), 7u);
  EXPECT_EQ(*PageSize(201), 200u);
}

TEST(ResourceId, TakesTheLastPartOfAName) {
  EXPECT_EQ(*ResourceId("name", "sessions", "sessions/a-1"), "a-1");
  for (const char* bad : {"", "sessions", "sessions/", "models/a", "sessions/a/b", "/sessions/a"}) {
    EXPECT_EQ(ResourceId("name", "sessions", bad).status().message(),
              "name: \"" + std::string(bad) + "\" must be of the form sessions/{id}");
  }
}

TEST(ResourceId, HasNoControlCharacters) {
  EXPECT_EQ(*ResourceId("name", "models", "models/Ärger 2"), "Ärger 2");
  EXPECT_EQ(ResourceId("name", "sessions", std::string("sessions/a\0b", 12)).status().message(),
            "name: \"sessions/a\\000b\" must be of the form sessions/{id}");
  for (const char* bad : {"sessions/a\n", "sessions/\x1f", "sessions/\x7f"}) {
    EXPECT_EQ(ResourceId("name", "sessions", bad).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
}

TEST(ComputeEstimate, RefusesAProblemThatMeasuresNothing) {
  v1::ComputeEstimateRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = SmallProblem();
  request.mutable_subject()->mutable_experiment()->mutable_problem()->clear_measured();
  const auto response = ComputeEstimate(request, 1, {});
  EXPECT_EQ(response.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(response.status().message()), testing::StartsWith("measured: "));
}

TEST(PropagationToProto, IsRowMajorAndTellsOfFailures) {
  Propagation propagation;
  propagation.time_s = {0, 1};
  propagation.outputs = {
      {.output = "x",
       .unit = "m",
       .mean = (Vector(2) << 1, 2).finished(),
       .std_dev = (Vector(2) << 3, 4).finished(),
       .quantiles = (Matrix(2, 2) << 5, 6, 7, 8).finished(),
       .residual = (Vector(2) << 9, 10).finished(),
       .from_draws = {false, true},
       .densities = {{(Vector(1) << 11).finished(), (Vector(1) << 12).finished()}}}};
  propagation.order = 3;
  propagation.terms = 4;
  propagation.points = 8;
  propagation.draws = 512;
  propagation.diagnostics = {{DiagnosticCode::kPointsFailed, "2 of 520 failed"}};
  const v1::ComputePropagationResponse response = ToProto(propagation, {0.1, 0.9});
  EXPECT_EQ(response.time_s_size(), 2);
  EXPECT_EQ(response.probabilities(1), 0.9);
  EXPECT_EQ(response.expansion().order(), 3);
  EXPECT_EQ(response.expansion().term_count(), 4);
  EXPECT_EQ(response.expansion().point_count(), 8);
  const auto& x = response.outputs(0);
  EXPECT_EQ(x.name(), "x");
  EXPECT_EQ(x.unit(), "m");
  EXPECT_EQ(x.mean(1), 2);
  EXPECT_EQ(x.std_dev(1), 4);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(x.quantiles(i), 5 + i);
  EXPECT_EQ(x.residual(0), 9);
  EXPECT_EQ(x.densities(0).value(0), 11);
  EXPECT_EQ(x.densities(0).density(0), 12);
  ASSERT_EQ(response.diagnostics_size(), 1);
  EXPECT_EQ(response.diagnostics(0).code(), v1::Diagnostic::POINTS_FAILED);
  EXPECT_EQ(response.diagnostics(0).message(), "2 of 520 failed");
  EXPECT_EQ(response.draw_count(), 512);
  EXPECT_THAT(x.from_draws(), testing::ElementsAre(false, true));
}

TEST(PropagationOptions, ComeFromTheRequest) {
  v1::ComputePropagationRequest request;
  request.set_until_s(2);
  request.set_step_s(0.5);
  EXPECT_EQ(ToPropagationOptions(request).probabilities, (std::vector<double>{0.025, 0.5, 0.975}));
  EXPECT_EQ(ToPropagationOptions(request).draws, 512);
  request.add_outputs("v");
  request.add_probabilities(0.3);
  request.set_density_bin_count(40);
  request.set_draw_count(64);
  const PropagationOptions options = ToPropagationOptions(request);
  EXPECT_EQ(options.until_s, 2);
  EXPECT_EQ(options.step_s, 0.5);
  EXPECT_EQ(options.outputs, (std::vector<std::string>{"v"}));
  EXPECT_EQ(options.probabilities, (std::vector<double>{0.3}));
  EXPECT_EQ(options.density_bins, 40);
  EXPECT_EQ(options.draws, 64);
}

TEST(CostGridOptions, ComeFromTheRequest) {
  v1::ComputeCostGridRequest request;
  request.add_parameters("k");
  request.set_point_count(11);
  (*request.mutable_held())["c"] = 0.5;
  const CostGridOptions options = ToCostGridOptions(request);
  EXPECT_EQ(options.parameters, (std::vector<std::string>{"k"}));
  EXPECT_EQ(options.points, 11);
  EXPECT_EQ(options.held.at("c"), 0.5);
}

TEST(EvaluateCost, WeighsThePriorAsTheRuleOfTheProblemChooses) {
  v1::ComputeCostGridRequest request;
  v1::Experiment& experiment = *request.mutable_subject()->mutable_experiment();
  *experiment.mutable_problem() = ProblemFromJson(R"({
    "model": {"equations": {"states": {"x": "a"}, "outputs": {"x": "x"}}},
    "uncertain": [{"name": "x_0", "normal": {"mean": 0, "stdDev": 2}},
                  {"name": "a", "normal": {"mean": 0, "stdDev": 3}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.05}}],
    "regularizationMode": "EVIDENCE"
  })");
  for (const double t : {0.5, 1.0, 1.5, 2.0}) experiment.mutable_measurements()->add_time_s(t);
  auto& x = *experiment.mutable_measurements()->add_channels();
  x.set_name("x");
  for (const double value : {1.05, 1.5, 1.95, 2.4}) x.add_values(value);
  request.set_point_count(3);
  v1::ComputeEstimateRequest estimate;
  *estimate.mutable_subject() = request.subject();
  const auto estimated = ComputeEstimate(estimate, 1, {});
  ASSERT_TRUE(estimated.ok()) << estimated.status();
  const double chosen = estimated->estimate().regularization();
  ASSERT_NE(chosen, 1);
  const auto cost = ComputeCostGrid(request, 1, {});
  ASSERT_TRUE(cost.ok()) << cost.status();
  for (int i = 0; i < cost->total_size(); ++i) {
    EXPECT_DOUBLE_EQ(cost->total(i), cost->mismatch(i) + chosen * cost->prior(i));
  }
}

TEST(AnalyzeSensitivity, AnswersRowsOfTimesByParameters) {
  v1::ComputeSensitivityRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = ProblemFromJson(R"({
    "model": {"equations": {"states": {"x": "a"}, "outputs": {"x": "x"}}},
    "uncertain": [{"name": "x_0", "normal": {"mean": 0, "stdDev": 2}},
                  {"name": "a", "normal": {"mean": 0, "stdDev": 3}}]
  })");
  request.set_until_s(2);
  request.set_step_s(1);
  const auto response = ComputeSensitivity(request, 1, {});
  ASSERT_TRUE(response.ok()) << response.status();
  EXPECT_THAT(response->time_s(), testing::ElementsAre(0, 1, 2));
  EXPECT_THAT(response->parameters(), testing::ElementsAre("x_0", "a"));
  ASSERT_EQ(response->outputs_size(), 1);
  const auto& x = response->outputs(0);
  EXPECT_EQ(x.name(), "x");
  ASSERT_EQ(x.total_size(), 6);
  ASSERT_EQ(x.first_order_size(), 6);
  // The variance is V = 4 + 9 t².
  EXPECT_NEAR(x.total(2), 4.0 / 13, 1e-9);
  EXPECT_NEAR(x.first_order(5), 36.0 / 40, 1e-9);
  EXPECT_EQ(x.residual_size(), 3);
  EXPECT_EQ(x.noise_std_dev_size(), 3);
  EXPECT_EQ(response->activity(0).parameter(), "a");
  EXPECT_EQ(response->expansion().order(), 3);
  EXPECT_EQ(response->draw_count(), 512);
}

TEST(SensitivityOptions, ComeFromTheRequest) {
  v1::ComputeSensitivityRequest request;
  request.set_until_s(2);
  EXPECT_EQ(ToSensitivityOptions(request).draws, 512);
  request.add_outputs("v");
  request.set_draw_count(64);
  const SensitivityOptions options = ToSensitivityOptions(request);
  EXPECT_EQ(options.until_s, 2);
  EXPECT_EQ(options.step_s, 0.02);
  EXPECT_EQ(options.outputs, (std::vector<std::string>{"v"}));
  EXPECT_EQ(options.draws, 64);
}

TEST(AnalyzeSensitivity, TakesAHundredthOfUntilForTheStep) {
  v1::ComputeSensitivityRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = SmallProblem();
  request.set_until_s(0.1);
  const auto response = ComputeSensitivity(request, 1, {});
  ASSERT_TRUE(response.ok()) << response.status();
  EXPECT_EQ(response->time_s_size(), 101);
}

v1::ComputeExperimentDesignRequest LineDesign() {
  v1::ComputeExperimentDesignRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = ProblemFromJson(R"({
    "model": {"equations": {"states": {"x": "a*u"}, "outputs": {"x": "x", "v": "a*u"},
                            "inputs": ["u"]}},
    "uncertain": [{"name": "a", "normal": {"mean": 1, "stdDev": 2}}],
    "inputs": [{"name": "u", "constant": {"amplitude": 1}}],
    "measured": [{"output": "x", "noise": {"absolute": 1}}]
  })");
  request.set_until_s(2);
  request.set_step_s(1);
  return request;
}

void AddConstant(const char* name, double amplitude, v1::ComputeExperimentDesignRequest& request) {
  auto& candidate = *request.add_candidates();
  candidate.set_name(name);
  auto& input = *candidate.add_inputs();
  input.set_name("u");
  input.mutable_constant()->set_amplitude(amplitude);
}

TEST(DesignExperiment, AnswersForTheProblemsOwnInputs) {
  const auto response = ComputeExperimentDesign(LineDesign(), 1, {});
  ASSERT_TRUE(response.ok()) << response.status();
  ASSERT_EQ(response->parameters_size(), 1);
  EXPECT_EQ(response->parameters(0).name(), "a");
  EXPECT_EQ(response->parameters(0).mean(), 1);
  EXPECT_EQ(response->parameters(0).std_dev(), 2);
  ASSERT_EQ(response->candidates_size(), 1);
  const auto& own = response->candidates(0);
  EXPECT_EQ(own.name(), "");
  // The output is x = a t at t = 1 and 2, which gives the precision ¼ + 1 + 4.
  EXPECT_NEAR(own.gain().bits(), 0.5 * std::log2(4 * 5.25), 1e-7);
  EXPECT_NEAR(own.gain().std_dev(0), 1 / std::sqrt(5.25), 1e-7);
  ASSERT_EQ(own.outputs_size(), 2);
  EXPECT_EQ(own.outputs(0).name(), "x");
  EXPECT_TRUE(own.outputs(0).measured());
  EXPECT_FALSE(own.outputs(1).measured());
  ASSERT_EQ(own.samples_size(), 2);
  EXPECT_EQ(own.samples(0).time_s(), 2);
  EXPECT_EQ(own.draw_count(), 64);
  EXPECT_EQ(own.trajectory_count(), 3 * 64);
}

TEST(DesignExperiment, PutsTheBestCandidateFirst) {
  v1::ComputeExperimentDesignRequest request = LineDesign();
  AddConstant("weak", 0.1, request);
  AddConstant("strong", 10, request);
  const auto response = ComputeExperimentDesign(request, 1, {});
  ASSERT_TRUE(response.ok()) << response.status();
  ASSERT_EQ(response->candidates_size(), 2);
  EXPECT_EQ(response->candidates(0).name(), "strong");
  EXPECT_EQ(response->candidates(1).name(), "weak");
  EXPECT_EQ(response->parameters_size(), 1);
}

TEST(DesignExperiment, NamesTheCandidateThatIsWrong) {
  v1::ComputeExperimentDesignRequest request = LineDesign();
  AddConstant("good", 1, request);
  request.add_candidates()->add_inputs()->set_name("w");
  const auto status = ComputeExperimentDesign(request, 1, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), testing::StartsWith("candidates[1].inputs[0]"));
}

TEST(DesignExperiment, RefusesNoiseThatItCannotUse) {
  const auto refusal = [](const auto& change) {
    v1::ComputeExperimentDesignRequest request = LineDesign();
    auto& possible = *request.add_possible();
    possible.set_output("v");
    possible.mutable_noise()->set_absolute(1);
    change(*possible.mutable_noise());
    const auto status = ComputeExperimentDesign(request, 1, {}).status();
    EXPECT_TRUE(status.ok() || absl::IsInvalidArgument(status)) << status;
    return std::string(status.message());
  };
  using Noise = v1::MeasuredOutput::Noise;
  EXPECT_EQ(refusal([](Noise& noise) { noise.set_full_scale(0); }), "");
  EXPECT_THAT(refusal([](Noise& noise) { noise.set_unknown(true); }),
              testing::StartsWith("possible[0].noise.unknown: is not available for a design"));
  EXPECT_THAT(refusal([](Noise& noise) { noise.mutable_correlation()->set_auto_(true); }),
              testing::StartsWith("possible[0].noise.correlation: is not available for a design"));
  EXPECT_THAT(refusal([](Noise& noise) { noise.set_outliers(Noise::HUBER); }),
              testing::StartsWith("possible[0].noise.outliers: are not available for a design"));
}

TEST(DesignExperiment, StartsFromWhatHasBeenMeasured) {
  v1::ComputeExperimentDesignRequest request = LineDesign();
  request.mutable_subject()->mutable_experiment()->mutable_measurements()->add_time_s(2);
  auto& x =
      *request.mutable_subject()->mutable_experiment()->mutable_measurements()->add_channels();
  x.set_name("x");
  x.add_values(3);
  const auto response = ComputeExperimentDesign(request, 1, {});
  ASSERT_TRUE(response.ok()) << response.status();
  // The precision is ¼ + 4 now, and 5 more then.
  EXPECT_NEAR(response->parameters(0).mean(), (0.25 * 1 + 2 * 3) / 4.25, 0.02);
  EXPECT_NEAR(response->parameters(0).std_dev(), 1 / std::sqrt(4.25), 1e-3);
  EXPECT_NEAR(response->candidates(0).gain().std_dev(0), 1 / std::sqrt(9.25), 1e-3);
}

}  // namespace
}  // namespace polyest::internal
