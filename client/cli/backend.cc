#include "client/cli/backend.h"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <cstdlib>

#include "client/cli/progress_line.h"
#include "core/common/status.h"
#include "core/umbridge/open_models.h"
#include "polyest/stop.h"
#include "proto/wire/operations/operations.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

class LocalBackend : public Backend {
 public:
  explicit LocalBackend(const Place& place)
      : threads_(place.threads),
        models_(OpenModels(place)),
        line_([this] { return WithTask(progress_->Describe()); }) {
    if (place.End()) stop_ = Stop({}, place.End());
  }

  absl::StatusOr<v1::ComputeEstimateResponse> ComputeEstimate(
      const v1::ComputeEstimateRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::ComputeEstimate(request, threads_, stop_, *models_, {}, MakeStore());
  }
  absl::StatusOr<v1::ComputePropagationResponse> ComputePropagation(
      const v1::ComputePropagationRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::ComputePropagation(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::ComputeCostGridResponse> ComputeCostGrid(
      const v1::ComputeCostGridRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::ComputeCostGrid(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::ComputeSensitivityResponse> ComputeSensitivity(
      const v1::ComputeSensitivityRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::ComputeSensitivity(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
      const v1::ComputeExperimentDesignRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::ComputeExperimentDesign(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::ListModels(request, *models_);
  }
  absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::GetModel(request, *models_);
  }
  absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
      const v1::ComputePosteriorRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::ComputePosterior(request, threads_, stop_, *models_, {}, MakeStore());
  }
  absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
      const v1::ComputeCostProfilesRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::ComputeCostProfiles(request, threads_, stop_, *models_, {},
                                                  MakeStore());
  }
  absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
      const v1::ComputeRegularizationSweepRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::ComputeRegularizationSweep(request, threads_, stop_, *models_, {},
                                                         MakeStore());
  }
  absl::StatusOr<v1::PredictResponse> Predict(const v1::PredictRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::internal::Predict(request, threads_, stop_, *models_, {}, MakeStore());
  }

 private:
  std::shared_ptr<SampleStore> MakeStore() const {
    return std::make_shared<WatchedStore>(progress_);
  }

  int threads_;
  absl::StatusOr<ModelLibrary> models_;
  Stop stop_;
  const std::shared_ptr<EstimationProgress> progress_ = std::make_shared<EstimationProgress>();
  ProgressLine line_;  // the last member, so that it is destroyed first
};

// Returns the response to a request with measurements. If a message was too large, the error says
// what to do about it.
template <typename Response>
absl::StatusOr<Response> WithSizeHint(absl::StatusOr<Response> response) {
  // Without details, gRPC itself has refused a message that is too large.
  if (!absl::IsResourceExhausted(response.status()) || RefusalOf(response.status())) {
    return response;
  }
  return absl::ResourceExhaustedError(absl::StrCat(
      response.status().message(), "; raise the daemon's --max-message-mb, or use polyest stream"));
}

class RemoteBackend : public Backend {
 public:
  explicit RemoteBackend(const Place& place)
      : client_(place.server, ToClientOptions(place)), line_([this, server = place.server] {
          return WithTask(absl::StrCat("waiting for ", server));
        }) {}

  absl::StatusOr<v1::ComputeEstimateResponse> ComputeEstimate(
      const v1::ComputeEstimateRequest& request) override {
    return WithSizeHint(client_.ComputeEstimate(request));
  }
  absl::StatusOr<v1::ComputePropagationResponse> ComputePropagation(
      const v1::ComputePropagationRequest& request) override {
    return client_.ComputePropagation(request);
  }
  absl::StatusOr<v1::ComputeCostGridResponse> ComputeCostGrid(
      const v1::ComputeCostGridRequest& request) override {
    return WithSizeHint(client_.ComputeCostGrid(request));
  }
  absl::StatusOr<v1::ComputeSensitivityResponse> ComputeSensitivity(
      const v1::ComputeSensitivityRequest& request) override {
    return client_.ComputeSensitivity(request);
  }
  absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
      const v1::ComputeExperimentDesignRequest& request) override {
    return WithSizeHint(client_.ComputeExperimentDesign(request));
  }
  absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request) override {
    return client_.ListModels(request);
  }
  absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request) override {
    return client_.GetModel(request);
  }
  absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
      const v1::ComputePosteriorRequest& request) override {
    return WithSizeHint(client_.ComputePosterior(request));
  }
  absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
      const v1::ComputeCostProfilesRequest& request) override {
    return WithSizeHint(client_.ComputeCostProfiles(request));
  }
  absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
      const v1::ComputeRegularizationSweepRequest& request) override {
    return WithSizeHint(client_.ComputeRegularizationSweep(request));
  }
  absl::StatusOr<v1::PredictResponse> Predict(const v1::PredictRequest& request) override {
    return WithSizeHint(client_.Predict(request));
  }

 private:
  Client client_;
  ProgressLine line_;
};

}  // namespace

void Backend::SetTask(const std::string& task) {
  const std::lock_guard lock(mutex_);
  task_ = task;
}

std::string Backend::WithTask(const std::string& progress) const {
  const std::lock_guard lock(mutex_);
  return task_.empty() ? progress : absl::StrCat(task_, " · ", progress);
}

ClientOptions ToClientOptions(const Place& place) {
  ClientOptions options;
  options.end = place.End();
  const ServerAccess& access = place.access;
  if (!access.ca_file.empty() || !access.certificate_file.empty() || !access.server_name.empty()) {
    options.tls =
        ClientTls{access.ca_file, access.certificate_file, access.key_file, access.server_name};
  }
  options.token_file = access.token_file;
  // The token is no option, since all users of a machine can see each other's command lines.
  const char* const token = std::getenv("POLYEST_TOKEN");
  if (token != nullptr) options.token = token;
  return options;
}

absl::StatusOr<ModelLibrary> OpenModels(const Place& place) {
  absl::StatusOr<ModelLibrary> models = OpenModels(ModelFolders{place.fmu_dir, place.umbridge_dir});
  // The error is one of the command line, whatever its code: it becomes INVALID_ARGUMENT.
  if (!models.ok()) return absl::InvalidArgumentError(models.status().message());
  return models;
}

std::unique_ptr<Backend> MakeBackend(const Place& place) {
  if (place.server.empty()) return std::make_unique<LocalBackend>(place);
  return std::make_unique<RemoteBackend>(place);
}

}  // namespace polyest::internal
