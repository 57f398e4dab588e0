#include "client/cpp/client.h"

#include <google/protobuf/util/time_util.h>
#include <grpc/support/time.h>
#include <grpcpp/support/error_details.h>

#include <chrono>
#include <utility>

#include "core/common/status.h"
#include "polyest/rpc/error_details.pb.h"
#include "server/refusal/refusal.h"

namespace polyest {
namespace {

using Stub = v1::EstimationService::Stub;

template <typename Detail>
bool Unpack(const google::protobuf::Any& any, Detail& detail) {
  return any.type_url() == "type.googleapis.com/google.rpc." + detail.GetDescriptor()->name() &&
         detail.ParseFromString(any.value());
}

// What the details of a status say; without a reason: nothing.
Refusal RefusalIn(const grpc::Status& status) {
  Refusal refusal;
  rpc::Status detailed;
  if (!grpc::ExtractErrorDetails(status, &detailed).ok()) return refusal;
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

}  // namespace

absl::Status FromGrpc(const grpc::Status& status) {
  // The codes of both are the same numbers.
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  const Refusal refusal = RefusalIn(status);
  if (status.ok() || refusal.reason.empty()) return absl::Status(code, status.error_message());
  return Refuse(code, status.error_message(), refusal);
}

Client::Client(const std::string& server, ClientOptions options)
    : server_(server),
      options_(std::move(options)),
      connection_(DaemonConnection::Open(server, options_)) {
  if (connection_.ok()) stub_ = v1::EstimationService::NewStub(connection_->channel());
}

template <typename Response, typename Request>
absl::StatusOr<Response> Client::Call(Method<Response, Request> method, const Request& request) {
  POLYEST_RETURN_IF_ERROR(connection_.status());
  grpc::ClientContext context;
  connection_->Identify(context);
  if (options_.deadline) {
    context.set_deadline(
        gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC),
                     gpr_time_from_millis(options_.deadline->count(), GPR_TIMESPAN)));
  }
  Response response;
  const grpc::Status status = (stub_.get()->*method)(&context, request, &response);
  if (!status.ok()) return FromGrpc(status);
  return response;
}

absl::StatusOr<v1::ListModelsResponse> Client::ListModels(const v1::ListModelsRequest& request) {
  return Call(&Stub::ListModels, request);
}

absl::StatusOr<v1::Model> Client::GetModel(const v1::GetModelRequest& request) {
  return Call(&Stub::GetModel, request);
}

absl::StatusOr<v1::EstimateResponse> Client::Estimate(const v1::EstimateRequest& request) {
  return Call(&Stub::Estimate, request);
}

absl::StatusOr<v1::PropagateResponse> Client::Propagate(const v1::PropagateRequest& request) {
  return Call(&Stub::Propagate, request);
}

absl::StatusOr<v1::EvaluateCostResponse> Client::EvaluateCost(
    const v1::EvaluateCostRequest& request) {
  return Call(&Stub::EvaluateCost, request);
}

absl::StatusOr<v1::AnalyzeSensitivityResponse> Client::AnalyzeSensitivity(
    const v1::AnalyzeSensitivityRequest& request) {
  return Call(&Stub::AnalyzeSensitivity, request);
}

absl::StatusOr<v1::DesignExperimentResponse> Client::DesignExperiment(
    const v1::DesignExperimentRequest& request) {
  return Call(&Stub::DesignExperiment, request);
}

absl::StatusOr<v1::Session> Client::CreateSession(const v1::CreateSessionRequest& request) {
  return Call(&Stub::CreateSession, request);
}

absl::StatusOr<v1::Session> Client::GetSession(const v1::GetSessionRequest& request) {
  return Call(&Stub::GetSession, request);
}

absl::StatusOr<v1::ListSessionsResponse> Client::ListSessions(
    const v1::ListSessionsRequest& request) {
  return Call(&Stub::ListSessions, request);
}

absl::Status Client::DeleteSession(const v1::DeleteSessionRequest& request) {
  return Call(&Stub::DeleteSession, request).status();
}

absl::StatusOr<v1::DaemonStatus> Client::GetStatus(const v1::GetStatusRequest& request) {
  return Call(&Stub::GetStatus, request);
}

absl::StatusOr<v1::AddMeasurementsResponse> Client::AddMeasurements(
    const v1::AddMeasurementsRequest& request) {
  return Call(&Stub::AddMeasurements, request);
}

absl::StatusOr<v1::EstimateResponse> Client::GetEstimate(const v1::GetEstimateRequest& request) {
  return Call(&Stub::GetEstimate, request);
}

absl::StatusOr<v1::GetPosteriorResponse> Client::GetPosterior(
    const v1::GetPosteriorRequest& request) {
  return Call(&Stub::GetPosterior, request);
}

absl::StatusOr<v1::ProfileCostResponse> Client::ProfileCost(const v1::ProfileCostRequest& request) {
  return Call(&Stub::ProfileCost, request);
}

absl::StatusOr<v1::SweepRegularizationResponse> Client::SweepRegularization(
    const v1::SweepRegularizationRequest& request) {
  return Call(&Stub::SweepRegularization, request);
}

absl::Status Client::WatchSession(
    const v1::WatchSessionRequest& request,
    const std::function<bool(const v1::EstimateResponse&)>& estimate) {
  POLYEST_RETURN_IF_ERROR(connection_.status());
  grpc::ClientContext context;
  connection_->Identify(context);
  const auto reader = stub_->WatchSession(&context, request);
  v1::EstimateResponse response;
  while (reader->Read(&response)) {
    if (estimate(response)) continue;
    context.TryCancel();
    reader->Finish();
    return absl::OkStatus();
  }
  return FromGrpc(reader->Finish());
}

absl::Status Client::ExportSession(
    const v1::ExportSessionRequest& request,
    const std::function<absl::Status(const v1::SessionRecord&)>& take) {
  POLYEST_RETURN_IF_ERROR(connection_.status());
  grpc::ClientContext context;
  connection_->Identify(context);
  const auto reader = stub_->ExportSession(&context, request);
  v1::SessionRecord record;
  while (reader->Read(&record)) {
    const absl::Status taken = take(record);
    if (taken.ok()) continue;
    context.TryCancel();
    reader->Finish();
    return taken;
  }
  return FromGrpc(reader->Finish());
}

absl::StatusOr<v1::Session> Client::ImportSession(
    const std::string& session_id,
    const std::function<absl::StatusOr<std::optional<v1::SessionRecord>>()>& next) {
  POLYEST_RETURN_IF_ERROR(connection_.status());
  grpc::ClientContext context;
  connection_->Identify(context);
  v1::Session session;
  const auto writer = stub_->ImportSession(&context, &session);
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
    if (!writer->Write(request)) break;  // refused: Finish says why
  }
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  if (!status.ok()) return FromGrpc(status);
  return session;
}

}  // namespace polyest
