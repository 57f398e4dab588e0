#pragma once

// The operations that need no session, in this process or by a daemon: the same answers.

#include <absl/status/statusor.h>

#include <memory>

#include "client/cli/arguments.h"
#include "client/cpp/client.h"
#include "core/fmu/model_library.h"
#include "polyest/v1/estimation_service.pb.h"

namespace polyest {

class Backend {
 public:
  virtual ~Backend() = default;
  virtual absl::StatusOr<v1::EstimateResponse> Estimate(const v1::EstimateRequest& request) = 0;
  virtual absl::StatusOr<v1::PropagateResponse> Propagate(const v1::PropagateRequest& request) = 0;
  virtual absl::StatusOr<v1::EvaluateCostResponse> EvaluateCost(
      const v1::EvaluateCostRequest& request) = 0;
  virtual absl::StatusOr<v1::AnalyzeSensitivityResponse> AnalyzeSensitivity(
      const v1::AnalyzeSensitivityRequest& request) = 0;
  virtual absl::StatusOr<v1::DesignExperimentResponse> DesignExperiment(
      const v1::DesignExperimentRequest& request) = 0;
  virtual absl::StatusOr<v1::ListModelsResponse> ListModels(
      const v1::ListModelsRequest& request) = 0;
  virtual absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request) = 0;
  virtual absl::StatusOr<v1::GetPosteriorResponse> GetPosterior(
      const v1::GetPosteriorRequest& request) = 0;
  virtual absl::StatusOr<v1::ProfileCostResponse> ProfileCost(
      const v1::ProfileCostRequest& request) = 0;
  virtual absl::StatusOr<v1::SweepRegularizationResponse> SweepRegularization(
      const v1::SweepRegularizationRequest& request) = 0;
};

ClientOptions ToClientOptions(const Place& place);

// The models of this process: the built-in ones, and the FMUs of --fmu-dir. INVALID_ARGUMENT when
// there is no such folder.
absl::StatusOr<ModelLibrary> OpenModels(const Place& place);

std::unique_ptr<Backend> MakeBackend(const Place& place);

}  // namespace polyest
