#pragma once

// The daemon's calls as functions.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/client_context.h>

#include <functional>
#include <memory>
#include <string>

#include "polyest/connection.h"
#include "polyest/v1/model_service.grpc.pb.h"
#include "polyest/v1/operation_service.grpc.pb.h"
#include "polyest/v1/problem_service.grpc.pb.h"
#include "polyest/v1/session_service.grpc.pb.h"
#include "polyest/v1/status_service.grpc.pb.h"
#include "polyest/v1/study_service.grpc.pb.h"

namespace polyest {

// Returns a gRPC status as the same absl::Status, with the Refusal (proto/wire/refusal) in its
// details.
absl::Status FromGrpc(const grpc::Status& status);

// Threads may share a client. Every function fails with the daemon's status; UNAVAILABLE when the
// daemon cannot be reached, DEADLINE_EXCEEDED when it did not answer in time; as
// DaemonConnection::Open when the options cannot be used.
class Client {
 public:
  // `server` is HOST:PORT. Connects on the first call.
  explicit Client(const std::string& server, ClientOptions options = {});

  // Lists the models that problems may name.
  absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request);
  // Returns one model.
  absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request);
  // Returns all that is wrong with a problem.
  absl::StatusOr<v1::CheckProblemResponse> CheckProblem(const v1::CheckProblemRequest& request);
  // Returns the JSON schema of problem files.
  absl::StatusOr<v1::GetProblemSchemaResponse> GetProblemSchema(
      const v1::GetProblemSchemaRequest& request);
  // Estimates from a problem and all of its measurements.
  absl::StatusOr<v1::ComputeEstimateResponse> ComputeEstimate(
      const v1::ComputeEstimateRequest& request);
  // Returns what the prior predicts of the outputs over time.
  absl::StatusOr<v1::ComputePropagationResponse> ComputePropagation(
      const v1::ComputePropagationRequest& request);
  // Returns the cost over one or two parameters.
  absl::StatusOr<v1::ComputeCostGridResponse> ComputeCostGrid(
      const v1::ComputeCostGridRequest& request);
  // Returns which parameters matter, and when.
  absl::StatusOr<v1::ComputeSensitivityResponse> ComputeSensitivity(
      const v1::ComputeSensitivityRequest& request);
  // Returns what an experiment is expected to tell.
  absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
      const v1::ComputeExperimentDesignRequest& request);
  // Returns the posterior in full.
  absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
      const v1::ComputePosteriorRequest& request);
  // Returns profiles of the cost.
  absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
      const v1::ComputeCostProfilesRequest& request);
  // Returns the minima of the cost over the regularization weight.
  absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
      const v1::ComputeRegularizationSweepRequest& request);
  // Starts a computation that can be polled and cancelled.
  absl::StatusOr<v1::Operation> StartComputation(const v1::StartComputationRequest& request);
  // Returns the state of a computation, and its result when it is done.
  absl::StatusOr<v1::Operation> GetOperation(const v1::GetOperationRequest& request);
  // Lists computations.
  absl::StatusOr<v1::ListOperationsResponse> ListOperations(
      const v1::ListOperationsRequest& request);
  // Asks a computation to end early.
  absl::StatusOr<v1::Operation> CancelOperation(const v1::CancelOperationRequest& request);
  // Forgets a computation.
  absl::Status DeleteOperation(const v1::DeleteOperationRequest& request);
  // Creates a session for a problem.
  absl::StatusOr<v1::Session> CreateSession(const v1::CreateSessionRequest& request);
  // Returns one session.
  absl::StatusOr<v1::Session> GetSession(const v1::GetSessionRequest& request);
  // Lists sessions.
  absl::StatusOr<v1::ListSessionsResponse> ListSessions(const v1::ListSessionsRequest& request);
  // Deletes a session with its measurements.
  absl::Status DeleteSession(const v1::DeleteSessionRequest& request);
  // Adds a batch of measurements to a session.
  absl::StatusOr<v1::AddMeasurementsResponse> AddMeasurements(
      const v1::AddMeasurementsRequest& request);
  // Returns a session's present estimate.
  absl::StatusOr<v1::Estimate> GetEstimate(const v1::GetEstimateRequest& request);
  // Returns what the daemon is doing.
  absl::StatusOr<v1::DaemonStatus> GetStatus(const v1::GetStatusRequest& request);
  // Calls `estimate` with each one until it returns false (then OK) or the daemon ends the stream.
  // `call`, if given, is a fresh context for this call: another thread may cancel it, which ends
  // the watch with CANCELLED.
  absl::Status WatchSession(const v1::WatchSessionRequest& request,
                            const std::function<bool(const v1::WatchSessionResponse&)>& estimate,
                            grpc::ClientContext* call = nullptr);
  // Calls `take` with each record until it is not OK: its status is then the answer.
  absl::Status ExportSession(const v1::ExportSessionRequest& request,
                             const std::function<absl::Status(const v1::SessionRecord&)>& take);
  // Sends what `next` gives until it gives nothing; a status of it that is not OK ends the import,
  // of which nothing stays, and is the answer. `session_id`: as in ImportSessionRequest.
  absl::StatusOr<v1::Session> ImportSession(
      const std::string& session_id,
      const std::function<absl::StatusOr<std::optional<v1::SessionRecord>>()>& next);

  // MeasurementStream uses these once another call has gone well.
  v1::SessionService::Stub& sessions() { return *sessions_; }
  // Adds the token to a call made on a stub.
  void Identify(grpc::ClientContext& call) const { connection_->Identify(call); }
  // Returns what Identify would add now, to see whether the token has changed.
  std::string Authorization() const { return connection_->Authorization(); }
  // The daemon's address, HOST:PORT.
  const std::string& server() const { return server_; }

 private:
  template <typename Stub, typename Response, typename Request>
  using Method = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Response*);
  template <typename Stub, typename Response, typename Request>
  absl::StatusOr<Response> Call(Stub* stub, Method<Stub, Response, Request> method,
                                const Request& request);

  std::string server_;
  ClientOptions options_;
  absl::StatusOr<DaemonConnection> connection_;
  // Null without a connection.
  std::unique_ptr<v1::ModelService::Stub> models_;
  std::unique_ptr<v1::ProblemService::Stub> problems_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
  std::unique_ptr<v1::StudyService::Stub> studies_;
  std::unique_ptr<v1::OperationService::Stub> operations_;
  std::unique_ptr<v1::StatusService::Stub> statuses_;
};

}  // namespace polyest
