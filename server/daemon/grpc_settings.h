#pragma once

// Sets what gRPC does besides calling the daemon's services: health, reflection, keepalive, and the
// bounds of what clients may do before anybody knows whose they are.

#include <grpcpp/server_builder.h>

#include <cstdint>

namespace polyest::internal {

// Sets what holds for all servers of this process. To be called before one is built.
void PrepareGrpc();

// Bounds what the clients of a server may do: the time of their handshakes, the streams of a
// connection, the size of a message in MiB, and the bytes that gRPC holds of what they send. Ends
// connections of clients that are gone.
void LimitClients(grpc::ServerBuilder& builder, int max_message_mb, int64_t buffer_bytes);

}  // namespace polyest::internal
