#pragma once

// Every operation that needs no session, without any transport: the daemon's services and the
// command line's --local both call these, so that their answers agree to the last digit.

#include <absl/status/statusor.h>

#include "core/common/stop.h"
#include "core/fmu/model_library.h"
#include "polyest/v1/estimation_service.pb.h"
#include "server/convert/problem_limits.h"

namespace polyest {

// threads is for propagation; answers do not depend on it. RESOURCE_EXHAUSTED for a problem beyond
// the limits.
absl::StatusOr<v1::EstimateResponse> RunEstimate(const v1::EstimateRequest& request, int threads,
                                                 const Stop& stop, const ModelLibrary& models = {},
                                                 const ProblemLimits& limits = {});
absl::StatusOr<v1::PropagateResponse> RunPropagate(const v1::PropagateRequest& request, int threads,
                                                   const Stop& stop,
                                                   const ModelLibrary& models = {},
                                                   const ProblemLimits& limits = {});
absl::StatusOr<v1::EvaluateCostResponse> RunEvaluateCost(const v1::EvaluateCostRequest& request,
                                                         int threads, const Stop& stop,
                                                         const ModelLibrary& models = {},
                                                         const ProblemLimits& limits = {});
absl::StatusOr<v1::AnalyzeSensitivityResponse> RunAnalyzeSensitivity(
    const v1::AnalyzeSensitivityRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {});
absl::StatusOr<v1::DesignExperimentResponse> RunDesignExperiment(
    const v1::DesignExperimentRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {});
// The one-shot form, without a session.
absl::StatusOr<v1::GetPosteriorResponse> RunGetPosterior(const v1::GetPosteriorRequest& request,
                                                         int threads, const Stop& stop,
                                                         const ModelLibrary& models = {},
                                                         const ProblemLimits& limits = {});
absl::StatusOr<v1::ProfileCostResponse> RunProfileCost(const v1::ProfileCostRequest& request,
                                                       int threads, const Stop& stop,
                                                       const ModelLibrary& models = {},
                                                       const ProblemLimits& limits = {});
absl::StatusOr<v1::SweepRegularizationResponse> RunSweepRegularization(
    const v1::SweepRegularizationRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {});

absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request,
                                                  const ModelLibrary& models = {});
absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request,
                                   const ModelLibrary& models = {});

}  // namespace polyest
