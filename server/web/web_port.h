#pragma once

// An HTTP port of the daemon, from its address to its end.

#include <absl/status/statusor.h>
#include <grpcpp/channel.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/security/caller.h"
#include "server/security/tls_material.h"
#include "server/web/http_message.h"
#include "server/web/web_server.h"

namespace polyest::internal {

class WebPort {
 public:
  // Says which protocol the port speaks.
  enum class Protocol {
    kCallsAndPage,  // calls as JSON, and the live page (gateway.h)
    kUmBridge,      // umbridge_gateway.h
  };
  struct Options {
    Protocol protocol = Protocol::kCallsAndPage;
    std::string host;                  // IPv6 in brackets
    int port = 0;                      // 0: any free one
    std::vector<std::string> names{};  // other hosts by which clients may call it
    TlsFiles tls{};                    // without a certificate: no encryption
    int max_message_mb = 64;
    int64_t body_memory_bytes = int64_t{256} << 20;  // of all requests together
    // Returns who calls, if the daemon knows, from the header Authorization and the common name of
    // a certificate, either of which may be missing.
    std::function<std::optional<Caller>(std::optional<std::string>, std::optional<std::string>)>
        who;
    std::function<void(int)> count = [](int) {};  // counts an answer by its status
  };

  // Takes the port. UNAVAILABLE when it cannot be listened on; errors of ReadTlsMaterial.
  static absl::StatusOr<std::unique_ptr<WebPort>> Open(const Options& options);

  int port() const { return server_->port(); }
  // Begins to answer. `channel` leads into the daemon's own server, which must outlive the port, or
  // a Stop that has returned true.
  void Serve(std::shared_ptr<grpc::Channel> channel);
  // Reads the certificates again; keeps the old ones if that fails.
  absl::Status ReloadTls();
  // Takes no more requests, waits for the answers under way until `deadline`, and closes all
  // connections. Returns whether nothing is left of them by `give_up`.
  bool Stop(std::chrono::steady_clock::time_point deadline,
            std::chrono::steady_clock::time_point give_up) {
    return server_->Stop(deadline, give_up);
  }

 private:
  WebPort(Options options, std::unique_ptr<WebServer> server)
      : options_(std::move(options)), server_(std::move(server)) {}

  const Options options_;
  std::unique_ptr<HttpHandler> MakeHandler(std::shared_ptr<grpc::Channel> channel) const;

  std::unique_ptr<HttpHandler> handler_;
  const std::unique_ptr<WebServer> server_;  // goes first, because its threads use the handler
};

}  // namespace polyest::internal
