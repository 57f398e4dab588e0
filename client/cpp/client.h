#pragma once

// The daemon's calls as functions.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/client_context.h>

#include <functional>
#include <memory>
#include <string>

#include "client/cpp/connection.h"
#include "polyest/v1/estimation_service.grpc.pb.h"

namespace polyest {

// A gRPC status as the same absl::Status, with the Refusal (server/refusal) that its details tell.
absl::Status FromGrpc(const grpc::Status& status);

// Threads may share a client. Every function fails with the daemon's status; UNAVAILABLE when the
// daemon cannot be reached, DEADLINE_EXCEEDED when it did not answer in time; as
// DaemonConnection::Open when the options cannot be used.
class Client {
 public:
  // `server` is HOST:PORT. Connects on the first call.
  explicit Client(const std::string& server, ClientOptions options = {});

  absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request);
  absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request);
  absl::StatusOr<v1::EstimateResponse> Estimate(const v1::EstimateRequest& request);
  absl::StatusOr<v1::PropagateResponse> Propagate(const v1::PropagateRequest& request);
  absl::StatusOr<v1::EvaluateCostResponse> EvaluateCost(const v1::EvaluateCostRequest& request);
  absl::StatusOr<v1::AnalyzeSensitivityResponse> AnalyzeSensitivity(
      const v1::AnalyzeSensitivityRequest& request);
  absl::StatusOr<v1::DesignExperimentResponse> DesignExperiment(
      const v1::DesignExperimentRequest& request);
  absl::StatusOr<v1::Session> CreateSession(const v1::CreateSessionRequest& request);
  absl::StatusOr<v1::Session> GetSession(const v1::GetSessionRequest& request);
  absl::StatusOr<v1::ListSessionsResponse> ListSessions(const v1::ListSessionsRequest& request);
  absl::Status DeleteSession(const v1::DeleteSessionRequest& request);
  absl::StatusOr<v1::DaemonStatus> GetStatus(const v1::GetStatusRequest& request);
  absl::StatusOr<v1::AddMeasurementsResponse> AddMeasurements(
      const v1::AddMeasurementsRequest& request);
  absl::StatusOr<v1::EstimateResponse> GetEstimate(const v1::GetEstimateRequest& request);
  absl::StatusOr<v1::GetPosteriorResponse> GetPosterior(const v1::GetPosteriorRequest& request);
  absl::StatusOr<v1::ProfileCostResponse> ProfileCost(const v1::ProfileCostRequest& request);
  absl::StatusOr<v1::SweepRegularizationResponse> SweepRegularization(
      const v1::SweepRegularizationRequest& request);
  // Calls `estimate` with each one until it returns false (then OK) or the daemon ends the stream.
  absl::Status WatchSession(const v1::WatchSessionRequest& request,
                            const std::function<bool(const v1::EstimateResponse&)>& estimate);
  // Calls `take` with each record until it is not OK: its status is then the answer.
  absl::Status ExportSession(const v1::ExportSessionRequest& request,
                             const std::function<absl::Status(const v1::SessionRecord&)>& take);
  // Sends what `next` gives until it gives nothing; a status of it that is not OK ends the import,
  // of which nothing stays, and is the answer. `session_id`: as in ImportSessionRequest.
  absl::StatusOr<v1::Session> ImportSession(
      const std::string& session_id,
      const std::function<absl::StatusOr<std::optional<v1::SessionRecord>>()>& next);

  // For MeasurementStream, once another call has gone well.
  v1::EstimationService::Stub& stub() { return *stub_; }
  void Identify(grpc::ClientContext& call) const { connection_->Identify(call); }
  std::string Authorization() const { return connection_->Authorization(); }
  const std::string& server() const { return server_; }

 private:
  template <typename Response, typename Request>
  using Method = grpc::Status (v1::EstimationService::Stub::*)(grpc::ClientContext*, const Request&,
                                                               Response*);
  template <typename Response, typename Request>
  absl::StatusOr<Response> Call(Method<Response, Request> method, const Request& request);

  std::string server_;
  ClientOptions options_;
  absl::StatusOr<DaemonConnection> connection_;
  std::unique_ptr<v1::EstimationService::Stub> stub_;  // null without a connection
};

}  // namespace polyest
