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

// Converts a gRPC status to an absl::Status of the same code and message. The Refusal
// (proto/wire/refusal) or the field in its details is kept.
absl::Status FromGrpc(const grpc::Status& status);

// Calls a daemon. Threads may share a client. Every function fails with the daemon's status, with
// UNAVAILABLE when the daemon cannot be reached, with DEADLINE_EXCEEDED when it did not answer in
// time, and with the error of DaemonConnection::Open when the options cannot be used.
class Client {
 public:
  // `server` is HOST:PORT. Connects on the first call.
  explicit Client(const std::string& server, ClientOptions options = {});

  // Lists the models that problems may name.
  absl::StatusOr<v1::ListModelsResponse> ListModels(const v1::ListModelsRequest& request);
  // Returns one model.
  absl::StatusOr<v1::Model> GetModel(const v1::GetModelRequest& request);
  // Returns all errors of a problem; if it has none, its warnings and a summary.
  absl::StatusOr<v1::CheckProblemResponse> CheckProblem(const v1::CheckProblemRequest& request);
  // Returns the JSON schema of problem files.
  absl::StatusOr<v1::GetProblemSchemaResponse> GetProblemSchema(
      const v1::GetProblemSchemaRequest& request);
  // Estimates the parameters of a problem from all of its measurements.
  absl::StatusOr<v1::ComputeEstimateResponse> ComputeEstimate(
      const v1::ComputeEstimateRequest& request);
  // Returns the outputs over time that the prior predicts.
  absl::StatusOr<v1::ComputePropagationResponse> ComputePropagation(
      const v1::ComputePropagationRequest& request);
  // Returns the cost over one or two parameters.
  absl::StatusOr<v1::ComputeCostGridResponse> ComputeCostGrid(
      const v1::ComputeCostGridRequest& request);
  // Returns how much of the variance of the outputs each parameter causes, over time.
  absl::StatusOr<v1::ComputeSensitivityResponse> ComputeSensitivity(
      const v1::ComputeSensitivityRequest& request);
  // Returns the information that candidates for the next experiment are expected to give.
  absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
      const v1::ComputeExperimentDesignRequest& request);
  // Returns the posterior's densities, quantiles and samples.
  absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
      const v1::ComputePosteriorRequest& request);
  // Returns the least cost over all other parameters, along each parameter.
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
  // Deletes a computation with its result.
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
  // Returns the daemon's version, load and uptime.
  absl::StatusOr<v1::DaemonStatus> GetStatus(const v1::GetStatusRequest& request);
  // Calls `estimate` with each response until it returns false, which gives OK, or until the daemon
  // ends the stream. `call`, if given, is a fresh context for this call: another thread may cancel
  // it, which ends the watch with CANCELLED.
  absl::Status WatchSession(const v1::WatchSessionRequest& request,
                            const std::function<bool(const v1::WatchSessionResponse&)>& estimate,
                            grpc::ClientContext* call = nullptr);
  // Calls `take` with each record of a session. Ends with the status of `take` when that is not OK.
  absl::Status ExportSession(const v1::ExportSessionRequest& request,
                             const std::function<absl::Status(const v1::SessionRecord&)>& take);
  // Sends the records that `next` returns until it returns none. An error of `next` cancels the
  // import, of which nothing remains, and is returned. `session_id` is that of
  // ImportSessionRequest.
  absl::StatusOr<v1::Session> ImportSession(
      const std::string& session_id,
      const std::function<absl::StatusOr<std::optional<v1::SessionRecord>>()>& next);

  // Returns the stub of the session service, for MeasurementStream. Another call must have
  // succeeded before.
  v1::SessionService::Stub& sessions() { return *sessions_; }
  // Adds the token to a call made on a stub.
  void Identify(grpc::ClientContext& call) const { connection_->Identify(call); }
  // Returns the value of the header that Identify would add now, to detect a changed token.
  std::string Authorization() const { return connection_->Authorization(); }
  // Returns the daemon's address, HOST:PORT.
  const std::string& server() const { return server_; }

 private:
  template <typename Stub, typename Response, typename Request>
  using Method = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Response*);
  // Adds the token and the deadline of the options to a call.
  void Prepare(grpc::ClientContext& call) const;
  // Returns the status of a call, with a hint if no connection could be made.
  absl::Status StatusOf(const grpc::Status& status) const;
  template <typename Stub, typename Response, typename Request>
  absl::StatusOr<Response> Call(Stub* stub, Method<Stub, Response, Request> method,
                                const Request& request);

  std::string server_;
  ClientOptions options_;
  absl::StatusOr<DaemonConnection> connection_;
  // The stubs are null if the connection could not be opened.
  std::unique_ptr<v1::ModelService::Stub> models_;
  std::unique_ptr<v1::ProblemService::Stub> problems_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
  std::unique_ptr<v1::StudyService::Stub> studies_;
  std::unique_ptr<v1::OperationService::Stub> operations_;
  std::unique_ptr<v1::StatusService::Stub> statuses_;
};

}  // namespace polyest
