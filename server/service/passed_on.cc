#include "server/service/passed_on.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <chrono>

#include "polyest/rpc/error_details.pb.h"
#include "proto/wire/refusal/refusal.h"
#include "server/service/status_mapping.h"
#include "server/telemetry/request_id.h"

namespace polyest::internal {
namespace {

// Returns whether an outcome is the other daemon's, which gives every call an id, and not gRPC's.
bool HasAnswered(const grpc::ClientContext& call) {
  return call.GetServerInitialMetadata().count(kRequestIdKey) > 0 ||
         call.GetServerTrailingMetadata().count(kRequestIdKey) > 0;
}

}  // namespace

bool IsOwnedElsewhere(const grpc::Status& outcome) {
  rpc::Status detailed;
  if (outcome.error_code() != grpc::StatusCode::UNAVAILABLE ||
      !detailed.ParseFromString(outcome.error_details())) {
    return false;
  }
  for (const google::protobuf::Any& detail : detailed.details()) {
    rpc::ErrorInfo info;
    if (absl::EndsWith(detail.type_url(), "google.rpc.ErrorInfo") &&
        info.ParseFromString(detail.value()) && info.reason() == kOwnedElsewhere) {
      return true;
    }
  }
  return false;
}

bool IsUnreached(const grpc::ClientContext& call, const grpc::Status& outcome) {
  return outcome.error_code() == grpc::StatusCode::UNAVAILABLE && !HasAnswered(call);
}

grpc::Status OutcomeFrom(const std::string& owner, const grpc::ClientContext& call,
                         const grpc::Status& outcome) {
  if (!IsUnreached(call, outcome)) return outcome;
  return ToGrpc(Refuse(
      absl::StatusCode::kUnavailable,
      absl::StrCat("the daemon at ", owner,
                   ", to which the call was passed on, is not reached: ", outcome.error_message()),
      {.reason = kOwnedElsewhere, .retry_delay = std::chrono::seconds(1), .owner = owner}));
}

void PassOnTrailers(const grpc::ClientContext& from, grpc::CallbackServerContext& to) {
  for (const auto& [key, value] : from.GetServerTrailingMetadata()) {
    const std::string name(key.data(), key.size());
    // The status carries its own, and this daemon sends the id.
    if (absl::StartsWith(name, "grpc-") || name == kRequestIdKey) continue;
    to.AddTrailingMetadata(name, std::string(value.data(), value.size()));
  }
}

}  // namespace polyest::internal
