#pragma once

// Tells clients how a call that was passed on to another daemon has ended.

#include <grpcpp/client_context.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <string>

namespace polyest::internal {

// Returns whether a daemon that was asked says that it does not own the session either.
bool IsOwnedElsewhere(const grpc::Status& outcome);

// Returns whether the other daemon has not answered at all, as far as is known.
bool IsUnreached(const grpc::ClientContext& call, const grpc::Status& outcome);

// Returns the outcome for the client: as the daemon at `owner` has told it, or, where that could
// not be reached, UNAVAILABLE with the details of a session of another daemon.
grpc::Status OutcomeFrom(const std::string& owner, const grpc::ClientContext& call,
                         const grpc::Status& outcome);

// Passes on what came behind the last message of the other daemon.
void PassOnTrailers(const grpc::ClientContext& from, grpc::CallbackServerContext& to);

}  // namespace polyest::internal
