#include "server/operations/operations.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "core/estimator/estimator.h"
#include "core/estimator/studies.h"
#include "server/convert/annotate.h"
#include "server/convert/estimate.h"
#include "server/convert/measurements.h"
#include "server/convert/model.h"
#include "server/convert/problem.h"
#include "server/convert/studies.h"
#include "server/operations/names.h"
#include "server/operations/pages.h"

namespace polyest {

absl::StatusOr<v1::EstimateResponse> RunEstimate(const v1::EstimateRequest& request, int threads,
                                                 const Stop& stop, const ModelLibrary& models) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ToProblem(request.problem(), models));
  POLYEST_ASSIGN_OR_RETURN(Samples samples, ToSamples(request.measurements()));
  POLYEST_ASSIGN_OR_RETURN(auto estimator,
                           Estimator::Make(std::move(problem), {.threads = threads, .store = {}}));
  samples.end_of_run = true;
  POLYEST_RETURN_IF_ERROR(estimator->Append(samples));
  POLYEST_RETURN_IF_ERROR(estimator->Process(stop));
  POLYEST_ASSIGN_OR_RETURN(Estimate estimate, estimator->CurrentEstimate(stop));
  v1::EstimateResponse response;
  *response.mutable_estimate() = ToProto(estimate);
  return response;
}

absl::StatusOr<v1::PropagateResponse> RunPropagate(const v1::PropagateRequest& request, int threads,
                                                   const Stop& stop, const ModelLibrary& models) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ToProblem(request.problem(), models));
  PropagationOptions options = ToPropagationOptions(request);
  options.threads = threads;
  POLYEST_ASSIGN_OR_RETURN(Propagation propagation, PropagatePrior(problem, options, stop));
  return ToProto(propagation, options.probabilities);
}

absl::StatusOr<v1::EvaluateCostResponse> RunEvaluateCost(const v1::EvaluateCostRequest& request,
                                                         int threads, const Stop& stop,
                                                         const ModelLibrary& models) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ToProblem(request.problem(), models));
  POLYEST_ASSIGN_OR_RETURN(Samples samples, ToSamples(request.measurements()));
  CostGridOptions options = ToCostGridOptions(request);
  options.threads = threads;
  POLYEST_ASSIGN_OR_RETURN(CostGrid grid, EvaluateCostGrid(problem, samples, options, stop));
  return ToProto(grid, problem);
}

absl::StatusOr<v1::AnalyzeSensitivityResponse> RunAnalyzeSensitivity(
    const v1::AnalyzeSensitivityRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem problem, ToProblem(request.problem(), models));
  SensitivityOptions options = ToSensitivityOptions(request);
  options.threads = threads;
  POLYEST_ASSIGN_OR_RETURN(SensitivityAnalysis analysis,
                           AnalyzeSensitivity(problem, options, stop));
  return ToProto(analysis);
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
