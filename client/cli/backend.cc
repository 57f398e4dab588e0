#include "client/cli/backend.h"

#include <absl/strings/str_cat.h>

#include <chrono>

#include "core/common/stop.h"
#include "server/operations/operations.h"

namespace polyest {
namespace {

class LocalBackend : public Backend {
 public:
  explicit LocalBackend(const Place& place) : threads_(place.threads) {
    if (place.deadline_s > 0) {
      const std::chrono::duration<double> length(place.deadline_s);
      stop_ =
          Stop({}, Stop::Clock::now() + std::chrono::duration_cast<Stop::Clock::duration>(length));
    }
  }

  absl::StatusOr<v1::EstimateResponse> Estimate(const v1::EstimateRequest& request) override {
    return RunEstimate(request, threads_, stop_);
  }
  absl::StatusOr<v1::PropagateResponse> Propagate(const v1::PropagateRequest& request) override {
    return RunPropagate(request, threads_, stop_);
  }
  absl::StatusOr<v1::EvaluateCostResponse> EvaluateCost(
      const v1::EvaluateCostRequest& request) override {
    return RunEvaluateCost(request, threads_, stop_);
  }
  absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request) override {
    return polyest::ListModels(request);
  }
  absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request) override {
    return polyest::GetModel(request);
  }

 private:
  int threads_;
  Stop stop_;
};

class RemoteBackend : public Backend {
 public:
  explicit RemoteBackend(const Place& place) : client_(place.server, ToClientOptions(place)) {}

  absl::StatusOr<v1::EstimateResponse> Estimate(const v1::EstimateRequest& request) override {
    auto response = client_.Estimate(request);
    if (absl::IsResourceExhausted(response.status())) {
      return absl::ResourceExhaustedError(absl::StrCat(
          response.status().message(), " (data too long for one message can be streamed)"));
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
  absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request) override {
    return client_.ListModels(request);
  }
  absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request) override {
    return client_.GetModel(request);
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
  return options;
}

std::unique_ptr<Backend> MakeBackend(const Place& place) {
  if (place.server.empty()) return std::make_unique<LocalBackend>(place);
  return std::make_unique<RemoteBackend>(place);
}

}  // namespace polyest
