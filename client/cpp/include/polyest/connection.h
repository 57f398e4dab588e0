#pragma once

// Connects a client to the daemon: the channel, its security, the token.

#include <absl/status/statusor.h>
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>

namespace polyest {

// TLS of a connection. The files are in PEM form.
struct ClientTls {
  std::string ca_file{};           // the CAs that the client trusts; empty: those of the system
  std::string certificate_file{};  // the client's own certificate; empty: none
  std::string key_file{};          // the key of the client's certificate
  std::string server_name{};       // the name in the daemon's certificate; empty: the host's
};

// Options of a client.
struct ClientOptions {
  // Longest duration of a call; none: no limit.
  std::optional<std::chrono::milliseconds> deadline{};
  // Silence after which the connection is probed. The daemon closes connections that are probed
  // more often than every 10 s.
  std::chrono::milliseconds keepalive{20'000};
  // Size of the largest response accepted, in bytes.
  int max_response_bytes = 64 << 20;
  // Settings of TLS; none: the connection is not encrypted.
  std::optional<ClientTls> tls{};
  // Bearer token by which the daemon knows the client; empty: none. It is sent only over TLS or to
  // a loopback address.
  std::string token{};
  // File that holds the token alone, in place of `token`; empty: none. It is read again for each
  // call, so that a new token takes effect. While the file cannot be used, the last token stays.
  std::string token_file{};
};

// A channel to the daemon and the token that goes with each call.
class DaemonConnection {
 public:
  // Prepares a connection to `server`, HOST:PORT, which is made on the first call. Refuses with
  // INVALID_ARGUMENT files that cannot be used, naming the file and never its content, and a token
  // that would be sent unencrypted over a network.
  static absl::StatusOr<DaemonConnection> Open(const std::string& server,
                                               const ClientOptions& options);

  // Returns the channel, for stubs of the services.
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  // Adds the token to a call.
  void Identify(grpc::ClientContext& call) const;
  // Returns the value of the header that Identify would add now, to detect a changed token.
  std::string Authorization() const;

 private:
  // Provides the last token that could be used.
  class TokenSource;

  DaemonConnection(std::shared_ptr<grpc::Channel> channel, std::shared_ptr<TokenSource> token);

  std::shared_ptr<grpc::Channel> channel_;
  std::shared_ptr<TokenSource> token_;
};

// Returns the status of a call. If no connection could be made because the two ends use TLS
// differently, the message also says what to check on either side.
absl::Status WithConnectionHint(const absl::Status& status, const std::optional<ClientTls>& tls);

}  // namespace polyest
