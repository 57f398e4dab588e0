#pragma once

// A backend that answers from a table, for an oscillator.

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/backend.h"

namespace polyest::internal {

inline absl::Status NotUsed() { return absl::UnimplementedError("not in the table"); }

// Weighs problems by a function, and knows the states of the oscillator.
class TableBackend : public Backend {
 public:
  using Weigh = std::function<absl::StatusOr<double>(const v1::Problem&)>;
  explicit TableBackend(Weigh weigh) : weigh_(std::move(weigh)) {}

  absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
      const v1::ComputePosteriorRequest& request) override {
    const absl::StatusOr<double> evidence = weigh_(request.subject().experiment().problem());
    if (!evidence.ok()) return evidence.status();
    v1::ComputePosteriorResponse response;
    response.set_measured_value_count(10);
    if (std::isfinite(*evidence)) response.set_log_evidence(*evidence);
    return response;
  }

  absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest&) override {
    v1::Model model;
    for (const auto& [name, unit] : {std::pair{"x", "m"}, std::pair{"v", "m/s"}}) {
      v1::Model::Quantity& state = *model.add_states();
      state.set_name(name);
      state.set_unit(unit);
      *model.add_outputs() = state;
    }
    return model;
  }

  // The spreads of the states, or the score of the rows held out: the log evidence ÷ 10.
  absl::StatusOr<v1::PredictResponse> Predict(const v1::PredictRequest& request) override {
    v1::PredictResponse response;
    if (request.has_record()) {
      if (!score_error_.ok()) return score_error_;
      scored_.push_back(request);
      for (const v1::Diagnostic::Code code : diagnostics_)
        response.add_diagnostics()->set_code(code);
      v1::PredictResponse::Score& score = *response.add_outputs()->mutable_score();
      score.set_sample_count(3);
      score.set_log_score(*weigh_(request.subject().experiment().problem()) / 30);
      return response;
    }
    for (const auto& [name, unit] : {std::pair{"x", "m"}, std::pair{"v", "m/s"}}) {
      v1::PredictResponse::Output& output = *response.add_outputs();
      output.set_output(name);
      output.set_unit(unit);
      for (const double mean : {-1.0, 1.0}) output.add_mean(mean);
    }
    for (const double time_s : {0.0, 1.0}) response.add_time_s(time_s);
    return response;
  }

  absl::StatusOr<v1::ComputeEstimateResponse> ComputeEstimate(
      const v1::ComputeEstimateRequest&) override {
    return NotUsed();
  }
  absl::StatusOr<v1::ComputePropagationResponse> ComputePropagation(
      const v1::ComputePropagationRequest&) override {
    return NotUsed();
  }
  absl::StatusOr<v1::ComputeCostGridResponse> ComputeCostGrid(
      const v1::ComputeCostGridRequest&) override {
    return NotUsed();
  }
  absl::StatusOr<v1::ComputeSensitivityResponse> ComputeSensitivity(
      const v1::ComputeSensitivityRequest&) override {
    return NotUsed();
  }
  absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
      const v1::ComputeExperimentDesignRequest&) override {
    return NotUsed();
  }
  absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest&) override {
    return NotUsed();
  }
  absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
      const v1::ComputeCostProfilesRequest&) override {
    return NotUsed();
  }
  absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
      const v1::ComputeRegularizationSweepRequest&) override {
    return NotUsed();
  }

  void RefuseScores(absl::Status error) { score_error_ = std::move(error); }
  void RaiseDiagnostics(std::vector<v1::Diagnostic::Code> codes) {
    diagnostics_ = std::move(codes);
  }
  // The requests for scores.
  const std::vector<v1::PredictRequest>& scored() const { return scored_; }

 private:
  Weigh weigh_;
  absl::Status score_error_;
  std::vector<v1::Diagnostic::Code> diagnostics_;
  std::vector<v1::PredictRequest> scored_;
};

// A record of 100 s with ten rows; `parameters` besides k.
inline v1::Experiment Oscillator(int parameters = 0) {
  v1::Experiment experiment;
  v1::Problem& problem = *experiment.mutable_problem();
  problem.mutable_model()->set_builtin("mass_spring_damper");
  problem.add_uncertain()->set_name("k");
  for (int i = 0; i < parameters; ++i) problem.add_uncertain()->set_name("p" + std::to_string(i));
  v1::MeasuredOutput& measured = *problem.add_measured();
  measured.set_output("x");
  measured.mutable_noise()->set_absolute(0.01);
  for (int row = 1; row <= 10; ++row) experiment.mutable_measurements()->add_time_s(10 * row);
  return experiment;
}

}  // namespace polyest::internal
