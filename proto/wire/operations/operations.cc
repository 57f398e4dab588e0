#include "proto/wire/operations/operations.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "core/estimator/estimator_access.h"
#include "core/estimator/studies/cost_grid.h"
#include "core/estimator/studies/prior_propagation.h"
#include "polyest/estimator.h"
#include "proto/wire/convert/annotate.h"
#include "proto/wire/convert/estimate.h"
#include "proto/wire/convert/experiment_design.h"
#include "proto/wire/convert/log_density.h"
#include "proto/wire/convert/measurements.h"
#include "proto/wire/convert/model.h"
#include "proto/wire/convert/posterior.h"
#include "proto/wire/convert/prediction.h"
#include "proto/wire/convert/problem_limits.h"
#include "proto/wire/convert/regularization.h"
#include "proto/wire/convert/studies.h"
#include "proto/wire/convert/wire_fields.h"
#include "proto/wire/operations/estimate_history.h"
#include "proto/wire/operations/names.h"
#include "proto/wire/operations/pages.h"

namespace polyest::internal {
namespace {

constexpr int kMaxHistoryPoints = 1000;

// Returns the experiment of a request. Refuses a session: only a daemon has sessions, and it
// handles them itself.
absl::StatusOr<const v1::Experiment*> ExperimentOf(const v1::Subject& subject) {
  if (subject.has_experiment()) return &subject.experiment();
  if (subject.has_session()) {
    return InvalidField("subject.session",
                        absl::StrCat("\"", subject.session(), "\" needs a daemon that has it"));
  }
  return InvalidField("subject", "must be given: a session, or an experiment with its problem");
}

// Returns an estimator without measurements for an experiment, and converts its measurements.
absl::StatusOr<std::unique_ptr<Estimator>> MakeEstimator(const v1::Experiment& experiment,
                                                         int threads, const ModelLibrary& models,
                                                         const ProblemLimits& limits,
                                                         std::shared_ptr<SampleStore> store,
                                                         const Stop& stop, Samples& samples) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem,
                           ToProblem(experiment.problem(), models, limits));
  POLYEST_RETURN_IF_ERROR(CheckRuns(limits, problem, experiment.measurements()));
  POLYEST_ASSIGN_OR_RETURN(samples, ToSamples(experiment.measurements(), *problem.problem().model));
  samples.end_of_run = true;
  return EstimatorAccess::Make(
      std::move(problem), {.threads = threads, .store = std::move(store), .snapshot = {}}, stop);
}

// Returns an estimator that holds all measurements of an experiment, none of them processed yet.
absl::StatusOr<std::unique_ptr<Estimator>> TakeAll(const v1::Experiment& experiment, int threads,
                                                   const ModelLibrary& models,
                                                   const ProblemLimits& limits, const Stop& stop,
                                                   std::shared_ptr<SampleStore> store = nullptr) {
  Samples samples;
  POLYEST_ASSIGN_OR_RETURN(auto estimator, MakeEstimator(experiment, threads, models, limits,
                                                         std::move(store), stop, samples));
  POLYEST_RETURN_IF_ERROR(WireFields(estimator->Append(samples)));
  return estimator;
}

// Returns the estimate from the measurements of an experiment; none if it has no measurements.
absl::StatusOr<std::optional<Estimate>> EstimateSoFar(const v1::Experiment& experiment, int threads,
                                                      const Stop& stop, const ModelLibrary& models,
                                                      const ProblemLimits& limits) {
  if (experiment.measurements().time_s().empty()) return std::optional<Estimate>();
  POLYEST_ASSIGN_OR_RETURN(const auto estimator,
                           TakeAll(experiment, threads, models, limits, stop));
  POLYEST_RETURN_IF_ERROR(estimator->Process(stop));
  return estimator->CurrentEstimate(stop);
}

// Returns the problem of the next experiment: the given problem with the inputs of a candidate and,
// if there is an estimate, with that as its prior.
absl::StatusOr<ResolvedProblem> NextExperiment(
    const v1::Problem& given, const v1::ComputeExperimentDesignRequest::Candidate& candidate,
    const std::optional<Estimate>& known, const ModelLibrary& models, const ProblemLimits& limits) {
  v1::Problem next = given;
  *next.mutable_inputs() = candidate.inputs();
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ToProblem(next, models, limits));
  if (known) return WithEstimateAsPrior(problem, *known);
  return problem;
}

}  // namespace

absl::StatusOr<v1::ComputeEstimateResponse> ComputeEstimate(
    const v1::ComputeEstimateRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits, std::shared_ptr<SampleStore> store) {
  POLYEST_ASSIGN_OR_RETURN(const auto* experiment, ExperimentOf(request.subject()));
  const int points = request.history_point_count();
  if (points < 0 || points > kMaxHistoryPoints) {
    return InvalidField("historyPointCount",
                        absl::StrFormat("%d must be from 0 to %d", points, kMaxHistoryPoints));
  }
  Samples samples;
  POLYEST_ASSIGN_OR_RETURN(const auto estimator, MakeEstimator(*experiment, threads, models, limits,
                                                               std::move(store), stop, samples));
  v1::ComputeEstimateResponse response;
  v1::EstimateHistory history;
  POLYEST_RETURN_IF_ERROR(
      ProcessWithHistory(std::move(samples), points, *estimator, history, stop));
  if (points > 0) *response.mutable_history() = std::move(history);
  POLYEST_ASSIGN_OR_RETURN(Estimate estimate, estimator->TestedEstimate(stop));
  *response.mutable_estimate() = ToProto(estimate);
  return response;
}

absl::StatusOr<v1::ComputePropagationResponse> ComputePropagation(
    const v1::ComputePropagationRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(const auto* experiment, ExperimentOf(request.subject()));
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem,
                           ToProblem(experiment->problem(), models, limits));
  PropagationOptions options = ToPropagationOptions(request);
  options.threads = threads;
  POLYEST_ASSIGN_OR_RETURN(Propagation propagation,
                           WireFields(PropagatePrior(problem, options, stop)));
  return ToProto(propagation, options.probabilities);
}

absl::StatusOr<v1::ComputeCostGridResponse> ComputeCostGrid(
    const v1::ComputeCostGridRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(const auto* experiment, ExperimentOf(request.subject()));
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem,
                           ToProblem(experiment->problem(), models, limits));
  POLYEST_ASSIGN_OR_RETURN(Samples samples,
                           ToSamples(experiment->measurements(), *problem.problem().model));
  CostGridOptions options = ToCostGridOptions(request);
  options.threads = threads;
  if (problem.problem().regularization_mode != RegularizationMode::kFixed) {
    POLYEST_ASSIGN_OR_RETURN(const auto estimator,
                             TakeAll(*experiment, threads, models, limits, stop));
    POLYEST_RETURN_IF_ERROR(estimator->Process(stop));
    POLYEST_ASSIGN_OR_RETURN(const Estimate estimate, estimator->CurrentEstimate(stop));
    options.regularization = estimate.regularization;
  }
  POLYEST_ASSIGN_OR_RETURN(CostGrid grid,
                           WireFields(EvaluateCostGrid(problem, samples, options, stop)));
  return ToProto(grid);
}

absl::StatusOr<v1::ComputeSensitivityResponse> ComputeSensitivity(
    const v1::ComputeSensitivityRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(const auto* experiment, ExperimentOf(request.subject()));
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem,
                           ToProblem(experiment->problem(), models, limits));
  SensitivityOptions options = ToSensitivityOptions(request);
  options.threads = threads;
  POLYEST_ASSIGN_OR_RETURN(SensitivityAnalysis analysis,
                           WireFields(AnalyzeSensitivity(problem, options, stop)));
  return ToProto(analysis);
}

absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
    const v1::ComputeExperimentDesignRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(const auto* experiment, ExperimentOf(request.subject()));
  POLYEST_ASSIGN_OR_RETURN(const ExperimentOptions options, ToExperimentOptions(request));
  POLYEST_RETURN_IF_ERROR(WireFields(options.Validate()));
  POLYEST_ASSIGN_OR_RETURN(const std::optional<Estimate> known,
                           EstimateSoFar(*experiment, threads, stop, models, limits));
  return ComputeExperimentDesign(request, experiment->problem(), known, threads, stop, models,
                                 limits);
}

absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
    const v1::ComputeExperimentDesignRequest& request, const v1::Problem& given,
    const std::optional<Estimate>& known, int threads, const Stop& stop, const ModelLibrary& models,
    const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(ExperimentOptions options, ToExperimentOptions(request));
  options.threads = threads;
  POLYEST_RETURN_IF_ERROR(WireFields(options.Validate()));
  v1::ComputeExperimentDesignRequest::Candidate own;
  *own.mutable_inputs() = given.inputs();
  v1::ComputeExperimentDesignResponse response;
  for (int i = 0; i < std::max(1, request.candidates_size()); ++i) {
    const bool is_own = request.candidates().empty();
    const auto& candidate = is_own ? own : request.candidates(i);
    const auto problem = NextExperiment(given, candidate, known, models, limits);
    auto design =
        WireFields(problem.ok() ? DesignExperiment(*problem, options, stop) : problem.status());
    if (!design.ok()) {
      if (is_own || !absl::IsInvalidArgument(design.status())) return design.status();
      return Within({"candidates", i}, design.status());
    }
    if (i == 0) AddParameters(*problem, response);
    *response.add_candidates() = ToProto(*design);
    response.mutable_candidates()->rbegin()->set_name(candidate.name());
  }
  std::stable_sort(response.mutable_candidates()->begin(), response.mutable_candidates()->end(),
                   [](const auto& a, const auto& b) { return a.gain().bits() > b.gain().bits(); });
  if (known) {
    for (const Diagnostic& diagnostic : known->diagnostics) {
      *response.add_diagnostics() = ToProto(diagnostic);
    }
  }
  return response;
}

absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
    const v1::ComputePosteriorRequest& request, Estimator& estimator, const Stop& stop) {
  const Prior& prior = EstimatorAccess::ProblemOf(estimator).prior();
  const PosteriorOptions options = ToPosteriorOptions(request, prior.Names());
  POLYEST_RETURN_IF_ERROR(WireFields(Validate(options, prior)));
  POLYEST_RETURN_IF_ERROR(estimator.Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const Posterior posterior, estimator.CurrentPosterior(options, stop));
  return ToProto(posterior, options);
}

absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
    const v1::ComputePosteriorRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits, std::shared_ptr<SampleStore> store) {
  POLYEST_ASSIGN_OR_RETURN(const auto* experiment, ExperimentOf(request.subject()));
  POLYEST_ASSIGN_OR_RETURN(const auto estimator,
                           TakeAll(*experiment, threads, models, limits, stop, std::move(store)));
  return ComputePosterior(request, *estimator, stop);
}

absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
    const v1::ComputeCostProfilesRequest& request, Estimator& estimator, const Stop& stop) {
  const ProfileOptions options = ToProfileOptions(request);
  POLYEST_RETURN_IF_ERROR(
      WireFields(Validate(options, EstimatorAccess::ProblemOf(estimator).prior())));
  POLYEST_RETURN_IF_ERROR(estimator.Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const CostProfiles profiles, estimator.CurrentProfiles(options, stop));
  return ToProto(profiles);
}

absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
    const v1::ComputeCostProfilesRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits, std::shared_ptr<SampleStore> store) {
  POLYEST_ASSIGN_OR_RETURN(const auto* experiment, ExperimentOf(request.subject()));
  POLYEST_ASSIGN_OR_RETURN(const auto estimator,
                           TakeAll(*experiment, threads, models, limits, stop, std::move(store)));
  return ComputeCostProfiles(request, *estimator, stop);
}

absl::StatusOr<v1::ComputeLogDensityResponse> ComputeLogDensity(
    const v1::ComputeLogDensityRequest& request, Estimator& estimator, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(estimator.Process(stop));
  // Only the estimator knows the parameters of all runs.
  LogDensityOptions none;
  none.derivative_order = request.derivative_order();
  POLYEST_ASSIGN_OR_RETURN(LogDensity density, WireFields(estimator.CurrentLogDensity(none, stop)));
  if (!request.values().empty()) {
    POLYEST_ASSIGN_OR_RETURN(const LogDensityOptions options,
                             ToLogDensityOptions(request, density.parameters));
    POLYEST_ASSIGN_OR_RETURN(density, WireFields(estimator.CurrentLogDensity(options, stop)));
  }
  return ToProto(density);
}

absl::StatusOr<v1::ComputeLogDensityResponse> ComputeLogDensity(
    const v1::ComputeLogDensityRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits, std::shared_ptr<SampleStore> store) {
  POLYEST_ASSIGN_OR_RETURN(const auto* experiment, ExperimentOf(request.subject()));
  POLYEST_ASSIGN_OR_RETURN(const auto estimator,
                           TakeAll(*experiment, threads, models, limits, stop, std::move(store)));
  return ComputeLogDensity(request, *estimator, stop);
}

absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
    const v1::ComputeRegularizationSweepRequest& request, Estimator& estimator, const Stop& stop) {
  const RegularizationOptions options = ToRegularizationOptions(request);
  POLYEST_RETURN_IF_ERROR(WireFields(options.Validate()));
  POLYEST_RETURN_IF_ERROR(estimator.Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const RegularizationSweep sweep,
                           estimator.CurrentRegularizationSweep(options, stop));
  return ToProto(sweep);
}

absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
    const v1::ComputeRegularizationSweepRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits, std::shared_ptr<SampleStore> store) {
  POLYEST_ASSIGN_OR_RETURN(const auto* experiment, ExperimentOf(request.subject()));
  POLYEST_ASSIGN_OR_RETURN(const auto estimator,
                           TakeAll(*experiment, threads, models, limits, stop, std::move(store)));
  return ComputeRegularizationSweep(request, *estimator, stop);
}

absl::StatusOr<v1::PredictResponse> Predict(const v1::PredictRequest& request, Estimator& estimator,
                                            const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const PredictionOptions options,
                           ToPredictionOptions(request, *estimator.problem().model));
  POLYEST_RETURN_IF_ERROR(estimator.Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const Prediction prediction,
                           WireFields(estimator.CurrentPrediction(options, stop)));
  return ToProto(prediction, options);
}

absl::StatusOr<v1::PredictResponse> Predict(const v1::PredictRequest& request, int threads,
                                            const Stop& stop, const ModelLibrary& models,
                                            const ProblemLimits& limits,
                                            std::shared_ptr<SampleStore> store) {
  POLYEST_ASSIGN_OR_RETURN(const auto* experiment, ExperimentOf(request.subject()));
  POLYEST_ASSIGN_OR_RETURN(const auto estimator,
                           TakeAll(*experiment, threads, models, limits, stop, std::move(store)));
  return Predict(request, *estimator, stop);
}

absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request,
                                                  const ModelLibrary& library) {
  POLYEST_ASSIGN_OR_RETURN(const size_t page_size, PageSize(request.page_size()));
  const std::vector<std::shared_ptr<const Model>> models = library.Models();
  size_t first = 0;
  if (!request.page_token().empty()) {
    // A page's token is the name of its last model.
    while (first < models.size() && models[first]->description().name != request.page_token()) {
      ++first;
    }
    if (first == models.size()) return UnknownPageToken(request.page_token());
    ++first;
  }
  v1::ListModelsResponse response;
  const size_t last = std::min(models.size(), first + page_size);
  for (size_t i = first; i < last; ++i) *response.add_models() = ToProto(*models[i]);
  if (last < models.size()) response.set_next_page_token(models[last - 1]->description().name);
  return response;
}

absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request, const ModelLibrary& models) {
  POLYEST_ASSIGN_OR_RETURN(const std::string id, ResourceId("name", "models", request.name()));
  POLYEST_ASSIGN_OR_RETURN(const auto model, models.Find(id));
  return ToProto(*model);
}

}  // namespace polyest::internal
