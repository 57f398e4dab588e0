#pragma once

// Tells the daemon's own gRPC server, as metadata, for which client the HTTP port calls it. A
// secret of this process goes with it, without which nobody is believed.

#include <grpcpp/server_context.h>

#include <string>
#include <utility>
#include <vector>

namespace polyest::internal {

// A client of the HTTP port.
struct WebClient {
  std::string peer;                // its address, "ipv4:192.0.2.7:50123"
  std::string certificate_name{};  // the common name of its certificate, escaped; empty: none
};

// Returns the metadata of a call that is made for a client.
std::vector<std::pair<std::string, std::string>> MetadataOf(const WebClient& client);

// Returns the address of the client for whom a call is made, be it by gRPC or over HTTP.
std::string ClientAddressOf(const grpc::ServerContextBase& call);

// Returns the common name of the certificate of the HTTP client for whom a call is made; empty for
// a call that comes by gRPC.
std::string WebCertificateOf(const grpc::ServerContextBase& call);

}  // namespace polyest::internal
