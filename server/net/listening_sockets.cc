#include "server/net/listening_sockets.h"

#include <absl/strings/str_format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/common/check.h"
#include "server/net/socket_address.h"

namespace polyest::internal {
namespace {

// Number of ports tried until one is free at all addresses of a name.
constexpr int kAttempts = 8;
// Time after which what was sent and not acknowledged ends a connection, ms.
constexpr int kUserTimeoutMs = 20'000;
// Pause where the system itself has no descriptors or memory left for a connection, ms.
constexpr int kPauseWithoutRoomMs = 10;

// The addresses that a name stands for.
struct Resolved {
  addrinfo* first = nullptr;
  ~Resolved() {
    if (first != nullptr) freeaddrinfo(first);
  }
};

void SetOption(const Descriptor& socket, int level, int name, int value) {
  setsockopt(socket.number(), level, name, &value, sizeof(value));
}

// Returns in words why an address cannot be listened on, given the error of the system call.
std::string WhyNotListening(int error) {
  if (error == EADDRINUSE) return "the port is in use";
  if (error == EADDRNOTAVAIL) return "the address is not this machine's";
  return std::strerror(error);
}

}  // namespace

ListeningSockets::ListeningSockets() : stop_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  POLYEST_CHECK(stop_.number() >= 0);
}

int ListeningSockets::Bind(const addrinfo& wanted, int& port) {
  Socket socket{
      Descriptor(::socket(wanted.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0))};
  const int number = socket.descriptor.number();
  if (number < 0) return errno;
  // An older daemon's closed connections do not hold the port; a daemon that listens does.
  SetOption(socket.descriptor, SOL_SOCKET, SO_REUSEADDR, 1);
  if (wanted.ai_family == AF_INET6) SetOption(socket.descriptor, IPPROTO_IPV6, IPV6_V6ONLY, 0);
  // Connections inherit these.
  SetOption(socket.descriptor, IPPROTO_TCP, TCP_NODELAY, 1);
  SetOption(socket.descriptor, IPPROTO_TCP, TCP_USER_TIMEOUT, kUserTimeoutMs);
  std::memcpy(&socket.address, wanted.ai_addr, wanted.ai_addrlen);
  SetPort(socket.address, port);
  auto* const address = reinterpret_cast<sockaddr*>(&socket.address);
  socklen_t size = sizeof(socket.address);
  if (bind(number, address, wanted.ai_addrlen) != 0 || listen(number, SOMAXCONN) != 0 ||
      getsockname(number, address, &size) != 0) {
    return errno;
  }
  port = ToIpAddress(socket.address).port;
  sockets_.push_back(std::move(socket));
  return 0;
}

int ListeningSockets::BindAll(const addrinfo* addresses, int& port) {
  const size_t before = sockets_.size();
  int last = 0;
  for (const addrinfo* one = addresses; one != nullptr; one = one->ai_next) {
    last = Bind(*one, port);
    // A machine may lack one of two kinds of addresses; another program must not have one of them.
    if (last != 0 && last != EADDRNOTAVAIL && last != EAFNOSUPPORT) {
      while (sockets_.size() > before) sockets_.pop_back();
      return last;
    }
  }
  return sockets_.size() > before ? 0 : last;
}

absl::Status ListeningSockets::Listen(const std::string& option, const std::string& host,
                                      int& port) {
  const std::string name = host.starts_with('[') ? host.substr(1, host.size() - 2) : host;
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  const auto refuse = [&](const std::string& why) {
    return absl::UnavailableError(
        absl::StrFormat("%s: cannot listen on %s:%d: %s", option, host, port, why));
  };
  Resolved resolved;
  const int unknown = getaddrinfo(name.c_str(), nullptr, &hints, &resolved.first);
  if (unknown != 0) return refuse(gai_strerror(unknown));
  int got = port;
  int error = BindAll(resolved.first, got);
  // A port that is free at the first address may be in use at the second.
  for (int attempt = 1; error == EADDRINUSE && port == 0 && attempt < kAttempts; ++attempt) {
    error = BindAll(resolved.first, got = 0);
  }
  if (error != 0) return refuse(WhyNotListening(error));
  port = got;
  waits_ = {{stop_.number(), POLLIN, 0}};
  for (const Socket& socket : sockets_) waits_.push_back({socket.descriptor.number(), POLLIN, 0});
  return absl::OkStatus();
}

int ListeningSockets::Await() {
  while (true) {
    if (poll(waits_.data(), waits_.size(), -1) < 0) continue;
    if (waits_.front().revents != 0) return -1;
    for (size_t i = 0; i < sockets_.size(); ++i) {
      last_ = (last_ + 1) % sockets_.size();
      if (waits_[last_ + 1].revents != 0) return waits_[last_ + 1].fd;
    }
  }
}

ListeningSockets::Connection ListeningSockets::Accept() {
  Connection connection;
  while (connection.descriptor < 0) {
    const int socket = Await();
    if (socket < 0) break;
    socklen_t size = sizeof(connection.from);
    connection.descriptor = accept4(socket, reinterpret_cast<sockaddr*>(&connection.from), &size,
                                    SOCK_NONBLOCK | SOCK_CLOEXEC);
    const int error = connection.descriptor < 0 ? errno : 0;
    if (error == 0 || error == EAGAIN || error == EINTR || error == ECONNABORTED) continue;
    if (warnings_.Admit("accept")) {
      spdlog::error("connections cannot be accepted: {}", std::strerror(error));
    }
    pollfd stop{stop_.number(), POLLIN, 0};
    poll(&stop, 1, kPauseWithoutRoomMs);
  }
  return connection;
}

void ListeningSockets::Stop() const { eventfd_write(stop_.number(), 1); }

std::vector<sockaddr_storage> ListeningSockets::Addresses() const {
  std::vector<sockaddr_storage> addresses;
  for (const Socket& socket : sockets_) addresses.push_back(socket.address);
  return addresses;
}

}  // namespace polyest::internal
