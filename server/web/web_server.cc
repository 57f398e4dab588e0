#include "server/web/web_server.h"

#include <absl/cleanup/cleanup.h>
#include <sys/socket.h>
#include <unistd.h>

#include <exception>
#include <iterator>
#include <new>
#include <string_view>
#include <utility>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

// The answer is one literal, because it is sent while there may be no memory for another.
#define POLYEST_FULL R"({"code":8,"message":"too many connections; try again later","details":[]})"
constexpr std::string_view kFull =
    "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\nRetry-After: 1\r\n"
    "Connection: close\r\nContent-Length: 73\r\n\r\n" POLYEST_FULL;
static_assert(sizeof(POLYEST_FULL) - 1 == 73, "Content-Length");
#undef POLYEST_FULL

// Bytes that the kernel holds of what a client does not read: a slow one does not fall far behind.
constexpr int kSendBuffer = 128 << 10;

void Prepare(int connection) {
  const int on = 1;
  setsockopt(connection, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof(on));
  setsockopt(connection, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof(kSendBuffer));
}

// Says that there is no room, as far as that is possible without waiting. What the client has sent
// is read, because the answer would be lost otherwise.
void RefuseConnection(int descriptor) {
  (void)!send(descriptor, kFull.data(), kFull.size(), MSG_NOSIGNAL);
  shutdown(descriptor, SHUT_WR);
  char bytes[16'384];
  (void)!recv(descriptor, bytes, sizeof(bytes), 0);
}

}  // namespace

absl::StatusOr<std::unique_ptr<WebServer>> WebServer::Open(const Options& options) {
  std::unique_ptr<WebServer> server(new WebServer(options));
  POLYEST_RETURN_IF_ERROR(server->sockets_.Listen(options.option, options.host, server->port_));
  return server;
}

WebServer::WebServer(const Options& options)
    : options_(options), port_(options.port), memory_(options.body_memory_bytes) {}

WebServer::~WebServer() {
  Stop(std::chrono::steady_clock::now(), std::chrono::steady_clock::time_point::max());
}

void WebServer::UseTls(std::shared_ptr<SSL_CTX> tls) {
  const std::lock_guard lock(mutex_);
  tls_.swap(tls);
}

void WebServer::Serve(const HttpHandler& handler) {
  handler_ = &handler;
  accepting_ = std::thread([this, &handler] { AcceptAll(handler); });
}

void WebServer::AcceptAll(const HttpHandler& handler) {
  while (true) {
    const int descriptor = sockets_.Accept().descriptor;
    if (descriptor < 0) return;
    Prepare(descriptor);
    Reap();
    Take(descriptor, handler);
  }
}

void WebServer::Take(int descriptor, const HttpHandler& handler) {
  Connections taken;
  // The system may not have the memory, which costs this connection only.
  try {
    taken.emplace_back();
  } catch (const std::bad_alloc&) {
    close(descriptor);
    return;
  }
  const std::lock_guard lock(mutex_);
  taken.front().socket.emplace(descriptor, tls_);
  if (!Start(taken, handler) && tls_ == nullptr) RefuseConnection(descriptor);
}

bool WebServer::Start(Connections& taken, const HttpHandler& handler) {
  const auto connection = taken.begin();
  // The system may not have the memory, or another thread.
  try {
    connection->host = connection->socket->PeerHost();
    const auto host = hosts_.try_emplace(connection->host, 0).first;
    const absl::Cleanup forget = [&] {
      if (host->second == 0) hosts_.erase(host);
    };
    if (std::ssize(open_) >= options_.connections || host->second >= options_.connections_of_host) {
      return false;
    }
    connection->thread = std::thread([this, connection, &handler] { Run(connection, handler); });
    ++host->second;
    open_.splice(open_.end(), taken);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

void WebServer::Run(Connections::iterator connection, const HttpHandler& handler) {
  ServeConnection(*connection->socket, sockets_.stop_descriptor(), options_.http, memory_, handler);
  const std::lock_guard lock(mutex_);
  connection->socket.reset();
  const auto host = hosts_.find(connection->host);
  if (--host->second == 0) hosts_.erase(host);
  over_.splice(over_.end(), open_, connection);
  ended_.notify_all();
}

void WebServer::Reap() {
  Connections over;
  {
    const std::lock_guard lock(mutex_);
    over.swap(over_);
  }
  for (Connection& connection : over) connection.thread.join();
}

bool WebServer::Stop(std::chrono::steady_clock::time_point deadline,
                     std::chrono::steady_clock::time_point give_up) {
  sockets_.Stop();
  if (accepting_.joinable()) accepting_.join();
  if (handler_ != nullptr) handler_->Stop();
  {
    std::unique_lock lock(mutex_);
    ended_.wait_until(lock, deadline, [this] { return open_.empty(); });
    for (const Connection& connection : open_) connection.socket->Shutdown();
    if (!ended_.wait_until(lock, give_up, [this] { return open_.empty(); })) return false;
  }
  Reap();
  handler_ = nullptr;  // it may be gone from here on
  return true;
}

}  // namespace polyest::internal
