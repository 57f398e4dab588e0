#include "tests/testing/hostile_proxy.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr size_t kBuffer = 16'384;
// Longest delay of a connection when no other one is made.
constexpr std::chrono::milliseconds kLongestHold{500};
// Silence of the daemon after which a repeated connection is closed.
constexpr int kSilenceMs = 200;

sockaddr_in Loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<uint16_t>(port));
  return address;
}

bool WriteAll(int socket, const char* data, size_t size) {
  while (size > 0) {
    const ssize_t written = send(socket, data, size, MSG_NOSIGNAL);
    if (written <= 0) return false;
    data += written;
    size -= static_cast<size_t>(written);
  }
  return true;
}

// Reads bytes that have arrived. Returns their number; 0 at the end of the connection.
ssize_t ReadSome(int socket, char* buffer) { return recv(socket, buffer, kBuffer, 0); }

}  // namespace

HostileProxy::HostileProxy(const std::string& server, uint64_t seed)
    : server_port_(std::stoi(server.substr(server.rfind(':') + 1))), random_(seed) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = Loopback(0);
  socklen_t length = sizeof(address);
  POLYEST_CHECK(bind(listener_, reinterpret_cast<sockaddr*>(&address), length) == 0);
  POLYEST_CHECK(listen(listener_, 64) == 0);
  POLYEST_CHECK(getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length) == 0);
  address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  thread_ = std::jthread([this] { Accept(); });
}

HostileProxy::~HostileProxy() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    for (const int socket : sockets_) shutdown(socket, SHUT_RDWR);
    accepted_.notify_all();
  }
  shutdown(listener_, SHUT_RDWR);
  thread_.join();
  connections_threads_.clear();
  for (const int socket : sockets_) close(socket);
  close(listener_);
}

HostileProxy::Harm HostileProxy::harm() const {
  const std::lock_guard lock(mutex_);
  return harm_;
}

int HostileProxy::Connect() const {
  const int server = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = Loopback(server_port_);
  if (connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) {
    return server;
  }
  close(server);
  return -1;
}

HostileProxy::Plan HostileProxy::Draw() {
  Plan plan;
  if (!hostile_) return plan;
  plan.cut_after = std::uniform_int_distribution<int64_t>(100, 6'000)(random_);
  plan.hold = random_() % 4 == 0;
  plan.repeat = random_() % 2 == 0;
  return plan;
}

void HostileProxy::Accept() {
  while (true) {
    const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    const std::lock_guard lock(mutex_);
    if (client < 0 || ending_) {
      if (client >= 0) close(client);
      return;
    }
    const int64_t number = ++connections_;
    accepted_.notify_all();
    sockets_.push_back(client);
    connections_threads_.emplace_back(
        [this, client, number, plan = Draw()] { Serve(client, plan, number); });
  }
}

bool HostileProxy::WaitForLater(int64_t number) {
  std::unique_lock lock(mutex_);
  ++harm_.held;
  accepted_.wait_for(lock, kLongestHold, [&] { return ending_ || connections_ > number; });
  return !ending_;
}

void HostileProxy::Serve(int client, Plan plan, int64_t number) {
  if (plan.hold && !WaitForLater(number)) return;
  const int server = Connect();
  std::string sent;
  char buffer[kBuffer];
  while (server >= 0) {
    pollfd ends[2] = {{client, POLLIN, 0}, {server, POLLIN, 0}};
    poll(ends, 2, -1);
    if (ends[1].revents != 0) {
      const ssize_t size = ReadSome(server, buffer);
      if (size <= 0 || !WriteAll(client, buffer, static_cast<size_t>(size))) break;
    }
    if (ends[0].revents == 0) continue;
    ssize_t size = ReadSome(client, buffer);
    if (size <= 0) break;
    const auto left = plan.cut_after - static_cast<int64_t>(sent.size());
    if (plan.cut_after >= 0) size = std::min<ssize_t>(size, left);
    if (!WriteAll(server, buffer, static_cast<size_t>(size))) break;
    sent.append(buffer, static_cast<size_t>(size));
    if (plan.cut_after >= 0 && static_cast<int64_t>(sent.size()) >= plan.cut_after) {
      const std::lock_guard lock(mutex_);
      ++harm_.cut;
      break;
    }
  }
  shutdown(client, SHUT_RDWR);
  if (server >= 0) close(server);
  if (plan.repeat) Repeat(sent);
}

// Sends the bytes again on a separate connection and discards the response.
void HostileProxy::Repeat(const std::string& bytes) {
  const int server = Connect();
  if (server < 0) return;
  {
    const std::lock_guard lock(mutex_);
    ++harm_.repeated;
  }
  char buffer[kBuffer];
  WriteAll(server, bytes.data(), bytes.size());
  pollfd end{server, POLLIN, 0};
  while (poll(&end, 1, kSilenceMs) > 0 && ReadSome(server, buffer) > 0) {
  }
  close(server);
}

}  // namespace polyest::internal
