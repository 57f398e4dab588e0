#pragma once

// How a client reaches the daemon: the channel, its security, the token.

#include <absl/status/statusor.h>
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>

namespace polyest {

// TLS of a connection: names of PEM files.
struct ClientTls {
  std::string ca_file{};  // of the CAs that may have signed the daemon's; empty: the system's
  std::string certificate_file{};  // the client's own; empty: none
  std::string key_file{};          // its key
  std::string server_name{};       // the name in the daemon's certificate; empty: the host's
};

// How a client connects and calls.
struct ClientOptions {
  // How long a call may take; none: as long as it takes.
  std::optional<std::chrono::milliseconds> deadline{};
  // Silence after which the connection is probed; the daemon's own, or it would refuse the probes.
  std::chrono::milliseconds keepalive{20'000};
  // The longest answer taken.
  int max_response_bytes = 64 << 20;
  // None: no TLS.
  std::optional<ClientTls> tls{};
  // What the daemon knows the client by; empty: none. It is sent over TLS, or to loopback, only.
  std::string token{};
  // A file of it alone, in place of `token`; empty: none. It is read again for each call, so that a
  // new token is taken; while it cannot be used, the last one stays.
  std::string token_file{};
};

// A channel to the daemon and the token that goes with each call.
class DaemonConnection {
 public:
  // `server` is HOST:PORT. Connects on the first call. INVALID_ARGUMENT, naming the file and never
  // what is in it, for files that cannot be used and for a token that would go unencrypted over a
  // network.
  static absl::StatusOr<DaemonConnection> Open(const std::string& server,
                                               const ClientOptions& options);

  // The channel, for stubs of the services.
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  // Adds the token to a call.
  void Identify(grpc::ClientContext& call) const;
  // Returns what Identify would add now, to see whether the token has changed.
  std::string Authorization() const;

 private:
  // The token, the last one that could be used.
  class TokenSource;

  DaemonConnection(std::shared_ptr<grpc::Channel> channel, std::shared_ptr<TokenSource> token);

  std::shared_ptr<grpc::Channel> channel_;
  std::shared_ptr<TokenSource> token_;
};

// Returns the status of a call. Where it failed because no connection came about, and the reason is
// how the two ends use TLS, the message also says what to look at on either side.
absl::Status WithConnectionHint(const absl::Status& status, const std::optional<ClientTls>& tls);

}  // namespace polyest
