#pragma once

// Lists models and computes studies of an experiment that comes with its request, without any
// transport. The daemon's services and the command line without --server both call these functions,
// so that their answers agree to the last digit.

#include <absl/status/statusor.h>

#include <memory>
#include <optional>

#include "core/external/model_library.h"
#include "polyest/estimator.h"
#include "polyest/samples.h"
#include "polyest/stop.h"
#include "polyest/v1/model_service.pb.h"
#include "polyest/v1/study_service.pb.h"
#include "proto/wire/convert/problem_limits.h"

namespace polyest::internal {

// Each of the following functions computes the response of the rpc of the same name. `threads` is
// the number of threads for propagation; responses do not depend on it. INVALID_ARGUMENT names the
// field, the value and the rule; it also refuses a subject that is a session. RESOURCE_EXHAUSTED
// refuses a problem beyond the limits. `store`, if given, must be empty and keeps the measurements:
// the caller can see the progress of the work from the reads of its store.

absl::StatusOr<v1::ComputeEstimateResponse> ComputeEstimate(
    const v1::ComputeEstimateRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {},
    std::shared_ptr<SampleStore> store = nullptr);
absl::StatusOr<v1::ComputePropagationResponse> ComputePropagation(
    const v1::ComputePropagationRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {});
absl::StatusOr<v1::ComputeCostGridResponse> ComputeCostGrid(
    const v1::ComputeCostGridRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {});
absl::StatusOr<v1::ComputeSensitivityResponse> ComputeSensitivity(
    const v1::ComputeSensitivityRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {});
absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
    const v1::ComputeExperimentDesignRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {});
absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
    const v1::ComputePosteriorRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {},
    std::shared_ptr<SampleStore> store = nullptr);
absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
    const v1::ComputeCostProfilesRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {},
    std::shared_ptr<SampleStore> store = nullptr);
absl::StatusOr<v1::ComputeLogDensityResponse> ComputeLogDensity(
    const v1::ComputeLogDensityRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {},
    std::shared_ptr<SampleStore> store = nullptr);
absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
    const v1::ComputeRegularizationSweepRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {},
    std::shared_ptr<SampleStore> store = nullptr);
absl::StatusOr<v1::PredictResponse> Predict(const v1::PredictRequest& request, int threads,
                                            const Stop& stop, const ModelLibrary& models = {},
                                            const ProblemLimits& limits = {},
                                            std::shared_ptr<SampleStore> store = nullptr);

// The following functions compute the same responses from an estimator that holds the measurements,
// such as that of a session. They ignore the subject of the request. They first process the
// measurements that the estimator has not processed yet. `sequence` stays 0.

absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
    const v1::ComputePosteriorRequest& request, Estimator& estimator, const Stop& stop);
absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
    const v1::ComputeCostProfilesRequest& request, Estimator& estimator, const Stop& stop);
absl::StatusOr<v1::ComputeLogDensityResponse> ComputeLogDensity(
    const v1::ComputeLogDensityRequest& request, Estimator& estimator, const Stop& stop);
absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
    const v1::ComputeRegularizationSweepRequest& request, Estimator& estimator, const Stop& stop);
absl::StatusOr<v1::PredictResponse> Predict(const v1::PredictRequest& request, Estimator& estimator,
                                            const Stop& stop);
// Computes the response from `known`, the estimate so far; without one, from the problem's prior.
absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
    const v1::ComputeExperimentDesignRequest& request, const v1::Problem& problem,
    const std::optional<Estimate>& known, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {});

// Returns a page of the built-in models and the FMUs in `models`.
absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request,
                                                  const ModelLibrary& models = {});
// Returns the model of that name, `models/{id}`.
absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request,
                                   const ModelLibrary& models = {});

}  // namespace polyest::internal
