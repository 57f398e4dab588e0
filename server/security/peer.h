#pragma once

// Tells what an edge on this machine says of the callers whose calls it passes on. It removes what
// clients say of themselves (deploy/edge/edge.cfg).

#include <grpcpp/server_context.h>

#include <optional>
#include <string>

namespace polyest::internal {

// Names the client's address, and the common name of its certificate, in the metadata of calls.
inline constexpr char kForwardedForKey[] = "x-forwarded-for";
inline constexpr char kCertificateNameKey[] = "x-client-certificate-name";

// Returns whether an address of gRPC, such as "ipv4:127.0.0.1:4711", is on this machine's loopback.
bool IsLoopbackPeer(const std::string& peer);

// Returns whether a call comes from loopback, where the edge is.
inline bool IsFromEdge(const grpc::ServerContextBase& call) { return IsLoopbackPeer(call.peer()); }

// Returns the value of an edge's header, escaped for logs; nothing unless there is exactly one.
std::optional<std::string> EdgeHeader(const grpc::ServerContextBase& call, const char* key);

}  // namespace polyest::internal
