#pragma once

// The models, and the studies of an experiment that comes with its request, without any transport:
// the daemon's services and the command line's --local both call these, so that their answers agree
// to the last digit.

#include <absl/status/statusor.h>

#include <memory>
#include <optional>

#include "core/fmu/model_library.h"
#include "polyest/estimator.h"
#include "polyest/samples.h"
#include "polyest/stop.h"
#include "polyest/v1/model_service.pb.h"
#include "polyest/v1/study_service.pb.h"
#include "proto/wire/convert/problem_limits.h"

namespace polyest::internal {

// Each of the following computes what the rpc of the same name answers. `threads` is for
// propagation; answers do not depend on it. INVALID_ARGUMENT names the field, the value and the
// rule, for a subject that is a session, too; RESOURCE_EXHAUSTED for a problem beyond the limits.
// `store`, if given, is an empty one to keep the measurements in: a store of the caller's own sees
// how far the work is.

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
absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
    const v1::ComputeRegularizationSweepRequest& request, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {},
    std::shared_ptr<SampleStore> store = nullptr);

// The following do the same for an estimator that holds the measurements, a session's say, whatever
// the subject of the request. They let it process what it has not processed yet; `sequence` stays
// 0.

absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
    const v1::ComputePosteriorRequest& request, Estimator& estimator, const Stop& stop);
absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
    const v1::ComputeCostProfilesRequest& request, Estimator& estimator, const Stop& stop);
absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
    const v1::ComputeRegularizationSweepRequest& request, Estimator& estimator, const Stop& stop);
// `known`: what has been estimated so far; none: the prior.
absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
    const v1::ComputeExperimentDesignRequest& request, const v1::Problem& problem,
    const std::optional<Estimate>& known, int threads, const Stop& stop,
    const ModelLibrary& models = {}, const ProblemLimits& limits = {});

absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request,
                                                  const ModelLibrary& models = {});
absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request,
                                   const ModelLibrary& models = {});

}  // namespace polyest::internal
