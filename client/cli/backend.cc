#include "client/cli/backend.h"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <cstdlib>

#include "core/common/status.h"
#include "core/common/stop.h"
#include "server/operations/operations.h"
#include "server/refusal/refusal.h"

namespace polyest {
namespace {

class LocalBackend : public Backend {
 public:
  explicit LocalBackend(const Place& place) : threads_(place.threads), models_(OpenModels(place)) {
    if (place.deadline_s > 0) {
      const std::chrono::duration<double> length(place.deadline_s);
      stop_ =
          Stop({}, Stop::Clock::now() + std::chrono::duration_cast<Stop::Clock::duration>(length));
    }
  }

  absl::StatusOr<v1::EstimateResponse> Estimate(const v1::EstimateRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return RunEstimate(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::PropagateResponse> Propagate(const v1::PropagateRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return RunPropagate(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::EvaluateCostResponse> EvaluateCost(
      const v1::EvaluateCostRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return RunEvaluateCost(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::AnalyzeSensitivityResponse> AnalyzeSensitivity(
      const v1::AnalyzeSensitivityRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return RunAnalyzeSensitivity(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::DesignExperimentResponse> DesignExperiment(
      const v1::DesignExperimentRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return RunDesignExperiment(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::ListModels(request, *models_);
  }
  absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return polyest::GetModel(request, *models_);
  }
  absl::StatusOr<v1::GetPosteriorResponse> GetPosterior(
      const v1::GetPosteriorRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return RunGetPosterior(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::ProfileCostResponse> ProfileCost(
      const v1::ProfileCostRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return RunProfileCost(request, threads_, stop_, *models_);
  }
  absl::StatusOr<v1::SweepRegularizationResponse> SweepRegularization(
      const v1::SweepRegularizationRequest& request) override {
    POLYEST_RETURN_IF_ERROR(models_.status());
    return RunSweepRegularization(request, threads_, stop_, *models_);
  }

 private:
  int threads_;
  absl::StatusOr<ModelLibrary> models_;
  Stop stop_;
};

class RemoteBackend : public Backend {
 public:
  explicit RemoteBackend(const Place& place) : client_(place.server, ToClientOptions(place)) {}

  absl::StatusOr<v1::EstimateResponse> Estimate(const v1::EstimateRequest& request) override {
    auto response = client_.Estimate(request);
    // What gRPC itself refuses, before the daemon sees it.
    if (absl::IsResourceExhausted(response.status()) && !RefusalOf(response.status())) {
      return absl::ResourceExhaustedError(
          absl::StrCat(response.status().message(),
                       " (--max-message-mb; data too long for one message can be streamed)"));
    }
    return response;
  }
  absl::StatusOr<v1::PropagateResponse> Propagate(const v1::PropagateRequest& request) override {
    return client_.Propagate(request);
  }
  absl::StatusOr<v1::EvaluateCostResponse> EvaluateCost(
      const v1::EvaluateCostRequest& request) override {
    return client_.EvaluateCost(request);
  }
  absl::StatusOr<v1::AnalyzeSensitivityResponse> AnalyzeSensitivity(
      const v1::AnalyzeSensitivityRequest& request) override {
    return client_.AnalyzeSensitivity(request);
  }
  absl::StatusOr<v1::DesignExperimentResponse> DesignExperiment(
      const v1::DesignExperimentRequest& request) override {
    return client_.DesignExperiment(request);
  }
  absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request) override {
    return client_.ListModels(request);
  }
  absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request) override {
    return client_.GetModel(request);
  }
  absl::StatusOr<v1::GetPosteriorResponse> GetPosterior(
      const v1::GetPosteriorRequest& request) override {
    return client_.GetPosterior(request);
  }
  absl::StatusOr<v1::ProfileCostResponse> ProfileCost(
      const v1::ProfileCostRequest& request) override {
    return client_.ProfileCost(request);
  }
  absl::StatusOr<v1::SweepRegularizationResponse> SweepRegularization(
      const v1::SweepRegularizationRequest& request) override {
    return client_.SweepRegularization(request);
  }

 private:
  Client client_;
};

}  // namespace

ClientOptions ToClientOptions(const Place& place) {
  ClientOptions options;
  if (place.deadline_s > 0) {
    options.deadline = std::chrono::ceil<std::chrono::milliseconds>(
        std::chrono::duration<double>(place.deadline_s));
  }
  const ServerAccess& access = place.access;
  if (!access.ca_file.empty() || !access.certificate_file.empty() || !access.server_name.empty()) {
    options.tls =
        ClientTls{access.ca_file, access.certificate_file, access.key_file, access.server_name};
  }
  options.token_file = access.token_file;
  // Not an option: every user of a machine sees the command lines of all.
  const char* const token = std::getenv("POLYEST_TOKEN");
  if (token != nullptr) options.token = token;
  return options;
}

absl::StatusOr<ModelLibrary> OpenModels(const Place& place) {
  if (place.fmu_dir.empty()) return ModelLibrary();
  absl::StatusOr<FmuCatalogue> fmus = FmuCatalogue::Open(place.fmu_dir);
  // A word of the command line is wrong, not a name of a request.
  if (!fmus.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("--fmu-dir: ", fmus.status().message()));
  }
  return ModelLibrary(*std::move(fmus));
}

std::unique_ptr<Backend> MakeBackend(const Place& place) {
  if (place.server.empty()) return std::make_unique<LocalBackend>(place);
  return std::make_unique<RemoteBackend>(place);
}

}  // namespace polyest
