#pragma once

// Puts the messages of gRPC and Protocol Buffers into the daemon's log.

#include <absl/strings/string_view.h>

#include <string>

namespace polyest::internal {

// Sends gRPC's messages to the log, at level debug: its errors, or those that GRPC_VERBOSITY asks
// for; those of Protocol Buffers, too, which anybody can cause by a malformed request. A connection
// that fails in its TLS handshake is logged as a warning, at most one a second: gRPC says nothing
// of it to the program, and nothing by default to the log.
void StartLibraryLog();

// Returns why a handshake failed, out of gRPC's message about it; empty for any other message.
std::string FailedHandshake(absl::string_view message);

}  // namespace polyest::internal
