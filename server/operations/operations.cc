#include "server/operations/operations.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "core/estimator/estimator.h"
#include "core/estimator/studies.h"
#include "server/convert/annotate.h"
#include "server/convert/estimate.h"
#include "server/convert/experiment_design.h"
#include "server/convert/measurements.h"
#include "server/convert/model.h"
#include "server/convert/posterior.h"
#include "server/convert/problem_limits.h"
#include "server/convert/regularization.h"
#include "server/convert/studies.h"
#include "server/operations/names.h"
#include "server/operations/pages.h"

namespace polyest {
namespace {

// An estimator of a request's problem that holds all its measurements, not yet processed.
template <typename Request>
absl::StatusOr<std::unique_ptr<Estimator>> TakeAll(const Request& request, int threads,
                                                   const ModelLibrary& models,
                                                   const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ToProblem(request.problem(), models, limits));
  POLYEST_RETURN_IF_ERROR(CheckRuns(limits, problem, request.measurements()));
  POLYEST_ASSIGN_OR_RETURN(Samples samples, ToSamples(request.measurements()));
  POLYEST_ASSIGN_OR_RETURN(
      auto estimator,
      Estimator::Make(std::move(problem), {.threads = threads, .store = {}, .snapshot = {}}));
  samples.end_of_run = true;
  POLYEST_RETURN_IF_ERROR(estimator->Append(samples));
  return estimator;
}

// What the measurements of a request have told, if there are any.
absl::StatusOr<std::optional<Estimate>> EstimateSoFar(const v1::DesignExperimentRequest& request,
                                                      int threads, const Stop& stop,
                                                      const ModelLibrary& models,
                                                      const ProblemLimits& limits) {
  if (request.measurements().time().empty()) return std::optional<Estimate>();
  POLYEST_ASSIGN_OR_RETURN(const auto estimator, TakeAll(request, threads, models, limits));
  POLYEST_RETURN_IF_ERROR(estimator->Process(stop));
  return estimator->CurrentEstimate(stop);
}

// The next experiment with the inputs of a candidate.
absl::StatusOr<ResolvedProblem> NextExperiment(
    const v1::Problem& given, const v1::DesignExperimentRequest::Candidate& candidate,
    const std::optional<Estimate>& known, const ModelLibrary& models, const ProblemLimits& limits) {
  v1::Problem next = given;
  *next.mutable_inputs() = candidate.inputs();
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ToProblem(next, models, limits));
  if (known) return WithEstimateAsPrior(problem, *known);
  return problem;
}

}  // namespace

absl::StatusOr<v1::EstimateResponse> RunEstimate(const v1::EstimateRequest& request, int threads,
                                                 const Stop& stop, const ModelLibrary& models,
                                                 const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(const auto estimator, TakeAll(request, threads, models, limits));
  POLYEST_RETURN_IF_ERROR(estimator->Process(stop));
  POLYEST_ASSIGN_OR_RETURN(Estimate estimate, estimator->CurrentEstimate(stop));
  v1::EstimateResponse response;
  *response.mutable_estimate() = ToProto(estimate);
  return response;
}

absl::StatusOr<v1::PropagateResponse> RunPropagate(const v1::PropagateRequest& request, int threads,
                                                   const Stop& stop, const ModelLibrary& models,
                                                   const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ToProblem(request.problem(), models, limits));
  PropagationOptions options = ToPropagationOptions(request);
  options.threads = threads;
  POLYEST_ASSIGN_OR_RETURN(Propagation propagation, PropagatePrior(problem, options, stop));
  return ToProto(propagation, options.probabilities);
}

absl::StatusOr<v1::EvaluateCostResponse> RunEvaluateCost(const v1::EvaluateCostRequest& request,
                                                         int threads, const Stop& stop,
                                                         const ModelLibrary& models,
                                                         const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ToProblem(request.problem(), models, limits));
  POLYEST_ASSIGN_OR_RETURN(Samples samples, ToSamples(request.measurements()));
  CostGridOptions options = ToCostGridOptions(request);
  options.threads = threads;
  POLYEST_ASSIGN_OR_RETURN(CostGrid grid, EvaluateCostGrid(problem, samples, options, stop));
  return ToProto(grid, problem);
}

absl::StatusOr<v1::AnalyzeSensitivityResponse> RunAnalyzeSensitivity(
    const v1::AnalyzeSensitivityRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ToProblem(request.problem(), models, limits));
  SensitivityOptions options = ToSensitivityOptions(request);
  options.threads = threads;
  POLYEST_ASSIGN_OR_RETURN(SensitivityAnalysis analysis,
                           AnalyzeSensitivity(problem, options, stop));
  return ToProto(analysis);
}

absl::StatusOr<v1::DesignExperimentResponse> RunDesignExperiment(
    const v1::DesignExperimentRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits) {
  ExperimentOptions options = ToExperimentOptions(request);
  options.threads = threads;
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_ASSIGN_OR_RETURN(const std::optional<Estimate> known,
                           EstimateSoFar(request, threads, stop, models, limits));
  v1::DesignExperimentRequest::Candidate own;
  *own.mutable_inputs() = request.problem().inputs();
  v1::DesignExperimentResponse response;
  for (int i = 0; i < std::max(1, request.candidates_size()); ++i) {
    const bool given = !request.candidates().empty();
    const auto& candidate = given ? request.candidates(i) : own;
    const auto problem = NextExperiment(request.problem(), candidate, known, models, limits);
    auto design = problem.ok() ? DesignExperiment(*problem, options, stop) : problem.status();
    if (!design.ok()) {
      if (!given || !absl::IsInvalidArgument(design.status())) return design.status();
      return InvalidField(absl::StrCat("candidates[", i, "]"), design.status().message());
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

absl::StatusOr<v1::GetPosteriorResponse> RunGetPosterior(const v1::GetPosteriorRequest& request,
                                                         int threads, const Stop& stop,
                                                         const ModelLibrary& models,
                                                         const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(const auto estimator, TakeAll(request, threads, models, limits));
  const PosteriorOptions options = ToPosteriorOptions(request);
  POLYEST_RETURN_IF_ERROR(options.Validate(estimator->problem().prior()));
  POLYEST_RETURN_IF_ERROR(estimator->Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const Posterior posterior, estimator->CurrentPosterior(options, stop));
  return ToProto(posterior, options);
}

absl::StatusOr<v1::ProfileCostResponse> RunProfileCost(const v1::ProfileCostRequest& request,
                                                       int threads, const Stop& stop,
                                                       const ModelLibrary& models,
                                                       const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(const auto estimator, TakeAll(request, threads, models, limits));
  const ProfileOptions options = ToProfileOptions(request);
  POLYEST_RETURN_IF_ERROR(options.Validate(estimator->problem().prior()));
  POLYEST_RETURN_IF_ERROR(estimator->Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const CostProfiles profiles, estimator->CurrentProfiles(options, stop));
  return ToProto(profiles);
}

absl::StatusOr<v1::SweepRegularizationResponse> RunSweepRegularization(
    const v1::SweepRegularizationRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models, const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(const auto estimator, TakeAll(request, threads, models, limits));
  const RegularizationOptions options = ToRegularizationOptions(request);
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_RETURN_IF_ERROR(estimator->Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const RegularizationSweep sweep,
                           estimator->CurrentRegularizationSweep(options, stop));
  return ToProto(sweep);
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

}  // namespace polyest
