#include "polyest/client.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <google/protobuf/util/time_util.h>
#include <grpc/support/time.h>
#include <grpcpp/support/error_details.h>

#include <chrono>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "polyest/rpc/error_details.pb.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest {

using namespace internal;

namespace {

template <typename Detail>
bool Unpack(const google::protobuf::Any& any, Detail& detail) {
  return any.type_url() == "type.googleapis.com/google.rpc." + detail.GetDescriptor()->name() &&
         detail.ParseFromString(any.value());
}

// Returns the refusal in the details of a status; an empty one if they name no reason.
Refusal RefusalIn(const rpc::Status& detailed) {
  Refusal refusal;
  rpc::ErrorInfo info;
  rpc::RetryInfo retry;
  for (const google::protobuf::Any& detail : detailed.details()) {
    if (Unpack(detail, info)) {
      refusal.reason = info.reason();
      const auto limit = info.metadata().find("limit");
      if (limit != info.metadata().end()) refusal.limit = limit->second;
    } else if (Unpack(detail, retry)) {
      refusal.retry_delay = std::chrono::milliseconds(
          google::protobuf::util::TimeUtil::DurationToMilliseconds(retry.retry_delay()));
    }
  }
  return refusal;
}

// Returns the field that the details of a status refuse; an empty string if there is none.
std::string RefusedField(const rpc::Status& detailed) {
  rpc::BadRequest bad;
  for (const google::protobuf::Any& detail : detailed.details()) {
    if (Unpack(detail, bad) && !bad.field_violations().empty()) {
      return bad.field_violations(0).field();
    }
  }
  return "";
}

// Returns when a call that begins now must have ended, on a clock that is never set back.
std::optional<gpr_timespec> EndOfCall(
    const std::optional<std::chrono::milliseconds>& longest,
    const std::optional<std::chrono::steady_clock::time_point>& end) {
  using std::chrono::nanoseconds;
  if (!longest && !end) return std::nullopt;
  auto left = nanoseconds::max();
  if (longest && *longest < left) left = *longest;
  if (end) left = std::min<nanoseconds>(left, *end - std::chrono::steady_clock::now());
  return gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC),
                      gpr_time_from_nanos(left.count(), GPR_TIMESPAN));
}

}  // namespace

absl::Status FromGrpc(const grpc::Status& status) {
  // gRPC and Abseil use the same numbers for their codes.
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  rpc::Status detailed;
  if (status.ok() || !grpc::ExtractErrorDetails(status, &detailed).ok()) {
    return absl::Status(code, status.error_message());
  }
  if (const FieldPath field(RefusedField(detailed)); !field.empty()) {
    const std::string message = status.error_message();
    absl::string_view sentence = message;
    // The daemon's message begins with the field if users are to see it.
    if (absl::ConsumePrefix(&sentence, absl::StrCat(field.ToString(), ": "))) {
      return FieldError(code, field, sentence);
    }
    return NamedInWords(field, absl::Status(code, sentence));
  }
  const Refusal refusal = RefusalIn(detailed);
  if (refusal.reason.empty()) return absl::Status(code, status.error_message());
  return Refuse(code, status.error_message(), refusal);
}

Client::Client(const std::string& server, ClientOptions options)
    : server_(server),
      options_(std::move(options)),
      connection_(DaemonConnection::Open(server, options_)) {
  if (!connection_.ok()) return;
  const auto channel = connection_->channel();
  models_ = v1::ModelService::NewStub(channel);
  problems_ = v1::ProblemService::NewStub(channel);
  sessions_ = v1::SessionService::NewStub(channel);
  studies_ = v1::StudyService::NewStub(channel);
  operations_ = v1::OperationService::NewStub(channel);
  statuses_ = v1::StatusService::NewStub(channel);
  backups_ = v1::BackupService::NewStub(channel);
  nodes_ = v1::NodeService::NewStub(channel);
}

void Client::Prepare(grpc::ClientContext& call) const {
  connection_->Identify(call);
  const auto end = EndOfCall(options_.deadline, options_.end);
  if (end) call.set_deadline(*end);
}

void Client::LimitToEnd(grpc::ClientContext& call) const {
  const auto end = EndOfCall(std::nullopt, options_.end);
  if (end) call.set_deadline(*end);
}

absl::Status Client::StatusOf(const grpc::Status& status) const {
  return WithConnectionHint(FromGrpc(status), options_.tls);
}

template <typename Stub, typename Response, typename Request>
absl::StatusOr<Response> Client::Call(Stub* stub, Method<Stub, Response, Request> method,
                                      const Request& request) {
  POLYEST_RETURN_IF_ERROR(connection_.status());
  grpc::ClientContext context;
  Prepare(context);
  Response response;
  const grpc::Status status = (stub->*method)(&context, request, &response);
  if (!status.ok()) return StatusOf(status);
  return response;
}

template <typename Stub, typename Request, typename Response, typename Take>
absl::Status Client::ReadAll(Stub* stub, StreamingMethod<Stub, Request, Response> method,
                             const Request& request, grpc::ClientContext& call, const Take& take) {
  POLYEST_RETURN_IF_ERROR(connection_.status());
  Prepare(call);
  const auto reader = (stub->*method)(&call, request);
  Response response;
  while (reader->Read(&response)) {
    const absl::Status taken = take(response);
    if (taken.ok()) continue;
    call.TryCancel();
    reader->Finish();
    return taken;
  }
  return StatusOf(reader->Finish());
}

absl::StatusOr<v1::ListModelsResponse> Client::ListModels(const v1::ListModelsRequest& request) {
  return Call(models_.get(), &v1::ModelService::Stub::ListModels, request);
}

absl::StatusOr<v1::Model> Client::GetModel(const v1::GetModelRequest& request) {
  return Call(models_.get(), &v1::ModelService::Stub::GetModel, request);
}

absl::StatusOr<v1::CheckProblemResponse> Client::CheckProblem(
    const v1::CheckProblemRequest& request) {
  return Call(problems_.get(), &v1::ProblemService::Stub::CheckProblem, request);
}

absl::StatusOr<v1::GetProblemSchemaResponse> Client::GetProblemSchema(
    const v1::GetProblemSchemaRequest& request) {
  return Call(problems_.get(), &v1::ProblemService::Stub::GetProblemSchema, request);
}

absl::StatusOr<v1::ComputeEstimateResponse> Client::ComputeEstimate(
    const v1::ComputeEstimateRequest& request) {
  return Call(studies_.get(), &v1::StudyService::Stub::ComputeEstimate, request);
}

absl::StatusOr<v1::ComputePropagationResponse> Client::ComputePropagation(
    const v1::ComputePropagationRequest& request) {
  return Call(studies_.get(), &v1::StudyService::Stub::ComputePropagation, request);
}

absl::StatusOr<v1::ComputeCostGridResponse> Client::ComputeCostGrid(
    const v1::ComputeCostGridRequest& request) {
  return Call(studies_.get(), &v1::StudyService::Stub::ComputeCostGrid, request);
}

absl::StatusOr<v1::ComputeSensitivityResponse> Client::ComputeSensitivity(
    const v1::ComputeSensitivityRequest& request) {
  return Call(studies_.get(), &v1::StudyService::Stub::ComputeSensitivity, request);
}

absl::StatusOr<v1::ComputeExperimentDesignResponse> Client::ComputeExperimentDesign(
    const v1::ComputeExperimentDesignRequest& request) {
  return Call(studies_.get(), &v1::StudyService::Stub::ComputeExperimentDesign, request);
}

absl::StatusOr<v1::ComputePosteriorResponse> Client::ComputePosterior(
    const v1::ComputePosteriorRequest& request) {
  return Call(studies_.get(), &v1::StudyService::Stub::ComputePosterior, request);
}

absl::StatusOr<v1::ComputeCostProfilesResponse> Client::ComputeCostProfiles(
    const v1::ComputeCostProfilesRequest& request) {
  return Call(studies_.get(), &v1::StudyService::Stub::ComputeCostProfiles, request);
}

absl::StatusOr<v1::ComputeLogDensityResponse> Client::ComputeLogDensity(
    const v1::ComputeLogDensityRequest& request) {
  return Call(studies_.get(), &v1::StudyService::Stub::ComputeLogDensity, request);
}

absl::StatusOr<v1::ComputeRegularizationSweepResponse> Client::ComputeRegularizationSweep(
    const v1::ComputeRegularizationSweepRequest& request) {
  return Call(studies_.get(), &v1::StudyService::Stub::ComputeRegularizationSweep, request);
}

absl::StatusOr<v1::PredictResponse> Client::Predict(const v1::PredictRequest& request) {
  return Call(studies_.get(), &v1::StudyService::Stub::Predict, request);
}

absl::StatusOr<v1::Operation> Client::StartComputation(const v1::StartComputationRequest& request) {
  return Call(operations_.get(), &v1::OperationService::Stub::StartComputation, request);
}

absl::StatusOr<v1::Operation> Client::GetOperation(const v1::GetOperationRequest& request) {
  return Call(operations_.get(), &v1::OperationService::Stub::GetOperation, request);
}

absl::StatusOr<v1::ListOperationsResponse> Client::ListOperations(
    const v1::ListOperationsRequest& request) {
  return Call(operations_.get(), &v1::OperationService::Stub::ListOperations, request);
}

absl::StatusOr<v1::Operation> Client::CancelOperation(const v1::CancelOperationRequest& request) {
  return Call(operations_.get(), &v1::OperationService::Stub::CancelOperation, request);
}

absl::Status Client::DeleteOperation(const v1::DeleteOperationRequest& request) {
  return Call(operations_.get(), &v1::OperationService::Stub::DeleteOperation, request).status();
}

absl::StatusOr<v1::Session> Client::CreateSession(const v1::CreateSessionRequest& request) {
  return Call(sessions_.get(), &v1::SessionService::Stub::CreateSession, request);
}

absl::StatusOr<v1::Session> Client::GetSession(const v1::GetSessionRequest& request) {
  return Call(sessions_.get(), &v1::SessionService::Stub::GetSession, request);
}

absl::StatusOr<v1::ListSessionsResponse> Client::ListSessions(
    const v1::ListSessionsRequest& request) {
  return Call(sessions_.get(), &v1::SessionService::Stub::ListSessions, request);
}

absl::Status Client::DeleteSession(const v1::DeleteSessionRequest& request) {
  return Call(sessions_.get(), &v1::SessionService::Stub::DeleteSession, request).status();
}

absl::StatusOr<v1::AddMeasurementsResponse> Client::AddMeasurements(
    const v1::AddMeasurementsRequest& request) {
  return Call(sessions_.get(), &v1::SessionService::Stub::AddMeasurements, request);
}

absl::StatusOr<v1::Estimate> Client::GetEstimate(const v1::GetEstimateRequest& request) {
  return Call(sessions_.get(), &v1::SessionService::Stub::GetEstimate, request);
}

absl::StatusOr<v1::GetHistoryResponse> Client::GetHistory(const v1::GetHistoryRequest& request) {
  return Call(sessions_.get(), &v1::SessionService::Stub::GetHistory, request);
}

absl::StatusOr<v1::DaemonStatus> Client::GetStatus(const v1::GetStatusRequest& request) {
  return Call(statuses_.get(), &v1::StatusService::Stub::GetStatus, request);
}

absl::StatusOr<v1::ListNodesResponse> Client::ListNodes(const v1::ListNodesRequest& request) {
  return Call(nodes_.get(), &v1::NodeService::Stub::ListNodes, request);
}

absl::StatusOr<v1::DrainNodeResponse> Client::DrainNode(const v1::DrainNodeRequest& request) {
  return Call(nodes_.get(), &v1::NodeService::Stub::DrainNode, request);
}

absl::Status Client::WatchSession(const v1::WatchSessionRequest& request,
                                  const std::function<bool(const v1::WatchSessionResponse&)>& take,
                                  grpc::ClientContext* call) {
  grpc::ClientContext own;
  bool left = false;
  const absl::Status status =
      ReadAll(sessions_.get(), &v1::SessionService::Stub::WatchSession, request,
              call != nullptr ? *call : own, [&](const v1::WatchSessionResponse& response) {
                left = !take(response);
                return left ? absl::CancelledError() : absl::OkStatus();
              });
  return left ? absl::OkStatus() : status;
}

absl::Status Client::ExportSession(
    const v1::ExportSessionRequest& request,
    const std::function<absl::Status(const v1::SessionRecord&)>& take) {
  grpc::ClientContext context;
  return ReadAll(sessions_.get(), &v1::SessionService::Stub::ExportSession, request, context, take);
}

absl::Status Client::DownloadBackup(
    const v1::DownloadBackupRequest& request,
    const std::function<absl::Status(const v1::DownloadBackupResponse&)>& take) {
  grpc::ClientContext context;
  return ReadAll(backups_.get(), &v1::BackupService::Stub::DownloadBackup, request, context, take);
}

absl::StatusOr<v1::Session> Client::ImportSession(
    const std::string& session_id,
    const std::function<absl::StatusOr<std::optional<v1::SessionRecord>>()>& next) {
  POLYEST_RETURN_IF_ERROR(connection_.status());
  grpc::ClientContext context;
  Prepare(context);
  v1::Session session;
  const auto writer = sessions_->ImportSession(&context, &session);
  v1::ImportSessionRequest request;
  request.set_session_id(session_id);
  while (true) {
    auto record = next();
    if (!record.ok()) {
      context.TryCancel();
      writer->Finish();
      return record.status();
    }
    if (!record->has_value()) break;
    *request.mutable_record() = **std::move(record);
    if (!writer->Write(request)) break;  // the daemon refused it: Finish returns the reason
  }
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  if (!status.ok()) return StatusOf(status);
  return session;
}

}  // namespace polyest
