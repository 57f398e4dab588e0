#pragma once

// Computes in this process or by a daemon, with the same responses.

#include <absl/status/statusor.h>

#include <memory>
#include <mutex>
#include <string>

#include "client/cli/arguments.h"
#include "core/external/model_library.h"
#include "polyest/client.h"
#include "polyest/v1/model_service.pb.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Operations that need no stream of measurements.
class Backend {
 public:
  virtual ~Backend() = default;
  virtual absl::StatusOr<v1::ComputeEstimateResponse> ComputeEstimate(
      const v1::ComputeEstimateRequest& request) = 0;
  virtual absl::StatusOr<v1::ComputePropagationResponse> ComputePropagation(
      const v1::ComputePropagationRequest& request) = 0;
  virtual absl::StatusOr<v1::ComputeCostGridResponse> ComputeCostGrid(
      const v1::ComputeCostGridRequest& request) = 0;
  virtual absl::StatusOr<v1::ComputeSensitivityResponse> ComputeSensitivity(
      const v1::ComputeSensitivityRequest& request) = 0;
  virtual absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
      const v1::ComputeExperimentDesignRequest& request) = 0;
  virtual absl::StatusOr<v1::ListModelsResponse> ListModels(
      const v1::ListModelsRequest& request) = 0;
  virtual absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request) = 0;
  virtual absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
      const v1::ComputePosteriorRequest& request) = 0;
  virtual absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
      const v1::ComputeCostProfilesRequest& request) = 0;
  virtual absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
      const v1::ComputeRegularizationSweepRequest& request) = 0;
  virtual absl::StatusOr<v1::PredictResponse> Predict(const v1::PredictRequest& request) = 0;

  // Puts what the next operations are for before the progress that the line shows.
  void SetTask(const std::string& task);

 protected:
  // Returns the progress with the task in front, if there is one. Any thread may call it.
  std::string WithTask(const std::string& progress) const;

 private:
  mutable std::mutex mutex_;
  std::string task_;
};

// Returns the options for the client of a place. The token comes from the environment variable
// POLYEST_TOKEN or from the file of --token-file.
ClientOptions ToClientOptions(const Place& place);

// Returns the models of this process: the built-in ones and those of --fmu-dir and --umbridge-dir.
// INVALID_ARGUMENT if such a folder cannot be used.
absl::StatusOr<ModelLibrary> OpenModels(const Place& place);

// Returns a backend that shows a line of progress on a terminal while it exists.
std::unique_ptr<Backend> MakeBackend(const Place& place);

}  // namespace polyest::internal
