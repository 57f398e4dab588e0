#pragma once

// Listens on the HTTP port and serves each connection on a thread of its own.

#include <absl/status/statusor.h>
#include <openssl/types.h>

#include <condition_variable>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "server/net/listening_sockets.h"
#include "server/web/client_socket.h"
#include "server/web/http_connection.h"

namespace polyest::internal {

class WebServer {
 public:
  struct Options {
    const char* option = "--web";  // that asks for the server, for errors
    std::string host;
    int port = 0;  // 0: any free one
    HttpLimits http{};
    int64_t body_memory_bytes = int64_t{256} << 20;  // of all requests together
    int connections = 512;
    int connections_of_host = 384;  // so that one client does not take all
  };

  // Takes the port, and lets clients wait there. UNAVAILABLE when it cannot be listened on.
  static absl::StatusOr<std::unique_ptr<WebServer>> Open(const Options& options);
  // Stops, if that was not done.
  ~WebServer();

  int port() const { return port_; }
  // Sets the encryption of connections to come; null: none.
  void UseTls(std::shared_ptr<SSL_CTX> tls);
  // Begins to serve. `handler` must outlive the server, or a Stop that returns true.
  void Serve(const HttpHandler& handler);
  // Takes no more connections, stops the handler, closes connections that are idle, and waits for
  // the others until `deadline`; those still open then are closed, too. Returns whether their
  // threads have ended by `give_up`: one that reads a large request does not look at the stop.
  bool Stop(std::chrono::steady_clock::time_point deadline,
            std::chrono::steady_clock::time_point give_up);

 private:
  struct Connection {
    std::optional<ClientSocket> socket;  // none once it is closed
    std::string host;
    std::thread thread;
  };
  using Connections = std::list<Connection>;

  explicit WebServer(const Options& options);
  void AcceptAll(const HttpHandler& handler);
  // Serves a connection, or refuses it when there are too many.
  void Take(int descriptor, const HttpHandler& handler);
  // Begins to serve the only connection of `taken`, which then is one of those that are open.
  // Returns false if there are too many. Called with the mutex held.
  bool Start(Connections& taken, const HttpHandler& handler);
  void Run(Connections::iterator connection, const HttpHandler& handler);
  // Joins the threads that have ended.
  void Reap();

  const Options options_;
  ListeningSockets sockets_;
  int port_;
  BodyMemory memory_;
  std::mutex mutex_;
  std::condition_variable ended_;
  std::shared_ptr<SSL_CTX> tls_;
  Connections open_;
  Connections over_;  // whose threads have ended or are about to
  std::map<std::string, int> hosts_;
  const HttpHandler* handler_ = nullptr;  // null while it does not serve
  std::thread accepting_;
};

}  // namespace polyest::internal
