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

// How a connection uses TLS; files are in PEM form.
struct ClientTls {
  // The CAs, one of which has signed the daemon's certificate; empty: the system's CAs.
  std::string ca_file{};
  std::string certificate_file{};  // the client's own certificate; empty: none
  std::string key_file{};          // the key of that certificate
  std::string server_name{};       // the name in the daemon's certificate; empty: the host's
};

// Options of a client.
struct ClientOptions {
  // How long a call may take, a stream such as a watch included; none: without limit.
  std::optional<std::chrono::milliseconds> deadline{};
  // When all calls must have ended, streams of measurements included; none: never.
  std::optional<std::chrono::steady_clock::time_point> end{};
  // Time without traffic after which the connection is probed, ≥ 10 s: the daemon closes
  // connections that are probed more often.
  std::chrono::milliseconds keepalive{20'000};
  // The largest message that is accepted from the daemon.
  int max_response_bytes = 64 << 20;
  // TLS of the connection; none: no TLS.
  std::optional<ClientTls> tls{};
  // The token by which the daemon knows the client; empty: none. It is sent only over TLS or to a
  // loopback address.
  std::string token{};
  // A file that holds only the token, in place of `token`; empty: none. It is read again for each
  // call, so a new token takes effect at once; while the file cannot be used, the last token stays.
  std::string token_file{};
};

// A channel to the daemon and the token that goes with each call.
class DaemonConnection {
 public:
  // `server` is HOST:PORT. Connects on the first call. INVALID_ARGUMENT if a file cannot be used
  // (the message names the file, not its contents) or if a token would go unencrypted over a
  // network.
  static absl::StatusOr<DaemonConnection> Open(const std::string& server,
                                               const ClientOptions& options);

  // Returns the channel, for stubs of the services.
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  // Adds the token to a call.
  void Identify(grpc::ClientContext& call) const;
  // Returns what Identify would add now; it shows whether the token has changed.
  std::string Authorization() const;

 private:
  // The last token that could be used.
  class TokenSource;

  DaemonConnection(std::shared_ptr<grpc::Channel> channel, std::shared_ptr<TokenSource> token);

  std::shared_ptr<grpc::Channel> channel_;
  std::shared_ptr<TokenSource> token_;
};

// Returns the status of a call. If no connection came about because of how the two ends use TLS,
// the message also says what to check on either side.
absl::Status WithConnectionHint(const absl::Status& status, const std::optional<ClientTls>& tls);

}  // namespace polyest
