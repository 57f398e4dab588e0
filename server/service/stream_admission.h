#pragma once

// Decides who may open a stream, and who may go on with one that is open.

#include <absl/status/statusor.h>
#include <grpcpp/server_context.h>

#include <memory>

#include "server/security/access_control.h"
#include "server/service/open_calls.h"
#include "server/service/service_context.h"
#include "server/sessions/session.h"

namespace polyest::internal {

// Lets a stream in if its caller may call the method and there is room for it, and returns the
// caller. The call stays open as long as the ticket, which is set. Errors are those of
// AccessControl::Authorize and of OpenCalls::Enter.
absl::StatusOr<Caller> AdmitStream(const ServiceContext& context,
                                   const grpc::CallbackServerContext& call, Method method,
                                   OpenCalls::Kind kind, const std::shared_ptr<Drainable>& stream,
                                   std::unique_ptr<OpenCalls::Ticket>& ticket);

// Returns the caller of an open stream to a session, which is null until it is known. Streams ask
// for each message, because a token may be revoked while they are open. PERMISSION_DENIED once the
// caller is of another tenant than the session; other errors are those of AccessControl::Authorize.
absl::StatusOr<Caller> AuthorizeStream(const ServiceContext& context,
                                       const grpc::CallbackServerContext& call, Method method,
                                       const Session* session);

}  // namespace polyest::internal
