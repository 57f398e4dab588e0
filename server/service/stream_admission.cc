#include "server/service/stream_admission.h"

#include "core/common/status.h"

namespace polyest::internal {

absl::StatusOr<Caller> AdmitStream(const ServiceContext& context,
                                   const grpc::CallbackServerContext& call, Method method,
                                   OpenCalls::Kind kind, const std::shared_ptr<Drainable>& stream,
                                   std::unique_ptr<OpenCalls::Ticket>& ticket) {
  POLYEST_ASSIGN_OR_RETURN(Caller caller, context.access.Authorize(call, method));
  POLYEST_ASSIGN_OR_RETURN(ticket, context.calls.Enter(kind, caller.tenant, stream));
  return caller;
}

absl::StatusOr<Caller> AuthorizeStream(const ServiceContext& context,
                                       const grpc::CallbackServerContext& call, Method method,
                                       const Session* session) {
  POLYEST_ASSIGN_OR_RETURN(Caller caller, context.access.Authorize(call, method));
  if (session != nullptr && session->tenant() != caller.tenant) {
    return absl::PermissionDeniedError("the token is another tenant's now");
  }
  return caller;
}

}  // namespace polyest::internal
