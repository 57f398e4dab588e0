#pragma once

// The daemon's calls as functions.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/client_context.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "polyest/connection.h"
#include "polyest/v1/backup_service.grpc.pb.h"
#include "polyest/v1/model_service.grpc.pb.h"
#include "polyest/v1/node_service.grpc.pb.h"
#include "polyest/v1/operation_service.grpc.pb.h"
#include "polyest/v1/problem_service.grpc.pb.h"
#include "polyest/v1/session_service.grpc.pb.h"
#include "polyest/v1/status_service.grpc.pb.h"
#include "polyest/v1/study_service.grpc.pb.h"

namespace polyest {

// Returns a gRPC status as the same absl::Status. If the daemon sent an ErrorInfo, the payloads
// `polyest/reason` (such as DISK_FULL), `polyest/limit` (the daemon's option) and
// `polyest/retry-delay-ms` (when to try again) hold it as text; one that does not apply is absent.
absl::Status FromGrpc(const grpc::Status& status);

// Calls the daemon. Threads may share a client. Every function fails with the daemon's status, with
// UNAVAILABLE if the daemon cannot be reached, with DEADLINE_EXCEEDED if it did not answer in time,
// and as DaemonConnection::Open if the options cannot be used.
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
  // Computes the estimate of a session, or of a problem with its measurements.
  absl::StatusOr<v1::ComputeEstimateResponse> ComputeEstimate(
      const v1::ComputeEstimateRequest& request);
  // Computes what the prior predicts for the outputs over time.
  absl::StatusOr<v1::ComputePropagationResponse> ComputePropagation(
      const v1::ComputePropagationRequest& request);
  // Computes the cost over one or two parameters.
  absl::StatusOr<v1::ComputeCostGridResponse> ComputeCostGrid(
      const v1::ComputeCostGridRequest& request);
  // Computes which parameters the outputs depend on, and when.
  absl::StatusOr<v1::ComputeSensitivityResponse> ComputeSensitivity(
      const v1::ComputeSensitivityRequest& request);
  // Computes what a next experiment is expected to tell.
  absl::StatusOr<v1::ComputeExperimentDesignResponse> ComputeExperimentDesign(
      const v1::ComputeExperimentDesignRequest& request);
  // Computes the posterior in detail.
  absl::StatusOr<v1::ComputePosteriorResponse> ComputePosterior(
      const v1::ComputePosteriorRequest& request);
  // Computes the cost over each parameter, minimized over all the others.
  absl::StatusOr<v1::ComputeCostProfilesResponse> ComputeCostProfiles(
      const v1::ComputeCostProfilesRequest& request);
  // Computes the log density of the posterior at given values, with gradient and Hessian if asked
  // for.
  absl::StatusOr<v1::ComputeLogDensityResponse> ComputeLogDensity(
      const v1::ComputeLogDensityRequest& request);
  // Computes the minima of the cost for several regularization weights.
  absl::StatusOr<v1::ComputeRegularizationSweepResponse> ComputeRegularizationSweep(
      const v1::ComputeRegularizationSweepRequest& request);
  // Computes what the posterior says of the signals, over the same record or another one.
  absl::StatusOr<v1::PredictResponse> Predict(const v1::PredictRequest& request);
  // Returns how a session's estimates came about.
  absl::StatusOr<v1::GetHistoryResponse> GetHistory(const v1::GetHistoryRequest& request);
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
  // Returns the daemon's version, load and memory.
  absl::StatusOr<v1::DaemonStatus> GetStatus(const v1::GetStatusRequest& request);
  // Lists the daemons that share the daemon's database.
  absl::StatusOr<v1::ListNodesResponse> ListNodes(const v1::ListNodesRequest& request);
  // Asks one of them to hand its sessions over to the others.
  absl::StatusOr<v1::DrainNodeResponse> DrainNode(const v1::DrainNodeRequest& request);
  // Calls `take` with the session's present estimate, then with new ones and, if the request asks
  // for them, predictions, until it returns false (the answer is then OK) or the daemon ends the
  // watch. `call`, if given, is a new context for this call: another thread may cancel it, which
  // ends the watch with CANCELLED.
  absl::Status WatchSession(const v1::WatchSessionRequest& request,
                            const std::function<bool(const v1::WatchSessionResponse&)>& take,
                            grpc::ClientContext* call = nullptr);
  // Calls `take` with each record of a session. If `take` fails, the export ends with its status.
  absl::Status ExportSession(const v1::ExportSessionRequest& request,
                             const std::function<absl::Status(const v1::SessionRecord&)>& take);
  // Sends the records that `next` returns until it returns none. If `next` fails, nothing is
  // imported and its status is returned. `session_id`: as in ImportSessionRequest.
  absl::StatusOr<v1::Session> ImportSession(
      const std::string& session_id,
      const std::function<absl::StatusOr<std::optional<v1::SessionRecord>>()>& next);

  // Calls `take` with each part of a backup of all sessions of all tenants. If `take` fails, the
  // backup ends with its status.
  absl::Status DownloadBackup(
      const v1::DownloadBackupRequest& request,
      const std::function<absl::Status(const v1::DownloadBackupResponse&)>& take);

  // The stub that MeasurementStream uses. Call it only after another call has succeeded.
  v1::SessionService::Stub& sessions() { return *sessions_; }
  // Adds the token to a call made on a stub.
  void Identify(grpc::ClientContext& call) const { connection_->Identify(call); }
  // Lets a call made on a stub end at the `end` of the options, if there is one.
  void LimitToEnd(grpc::ClientContext& call) const;
  // Returns what Identify would add now; it shows whether the token has changed.
  std::string Authorization() const { return connection_->Authorization(); }
  // Returns the daemon's address, HOST:PORT.
  const std::string& server() const { return server_; }

 private:
  template <typename Stub, typename Response, typename Request>
  using Method = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Response*);
  template <typename Stub, typename Request, typename Response>
  using StreamingMethod =
      std::unique_ptr<grpc::ClientReader<Response>> (Stub::*)(grpc::ClientContext*, const Request&);
  // Adds the token and the limits of the options to a call.
  void Prepare(grpc::ClientContext& call) const;
  // Returns the status of a call, with a hint if no connection could be made.
  absl::Status StatusOf(const grpc::Status& status) const;
  template <typename Stub, typename Response, typename Request>
  absl::StatusOr<Response> Call(Stub* stub, Method<Stub, Response, Request> method,
                                const Request& request);
  // Makes a call and gives each message that it is answered with to `take`. Once `take` returns an
  // error, cancels the call and returns that error.
  template <typename Stub, typename Request, typename Response, typename Take>
  absl::Status ReadAll(Stub* stub, StreamingMethod<Stub, Request, Response> method,
                       const Request& request, grpc::ClientContext& call, const Take& take);

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
  std::unique_ptr<v1::BackupService::Stub> backups_;
  std::unique_ptr<v1::NodeService::Stub> nodes_;
};

}  // namespace polyest
