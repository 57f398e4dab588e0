#include "server/web/listening_socket.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr int kBacklog = 512;
// Bytes that the kernel holds of what a client does not read: a slow one does not fall far behind.
constexpr int kSendBuffer = 128 << 10;
// Time after which a client that acknowledges nothing is given up.
constexpr int kUserTimeoutMs = 30'000;
// Time until the next try when there are no descriptors or no memory.
constexpr int kPauseMs = 50;

// Listens on an address; −1 if that fails, with the reason in errno.
int Listen(const addrinfo& address) {
  const int descriptor =
      socket(address.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, IPPROTO_TCP);
  if (descriptor < 0) return -1;
  // A port whose last daemon has just ended is taken at once, one that is listened on is not.
  const int on = 1;
  setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  const int both = 0;
  if (address.ai_family == AF_INET6) {
    setsockopt(descriptor, IPPROTO_IPV6, IPV6_V6ONLY, &both, sizeof(both));
  }
  if (bind(descriptor, address.ai_addr, address.ai_addrlen) == 0 &&
      listen(descriptor, kBacklog) == 0) {
    return descriptor;
  }
  const int error = errno;
  close(descriptor);
  errno = error;
  return -1;
}

int PortOf(int descriptor) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  POLYEST_CHECK(getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0);
  return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(address).sin6_port
                                             : reinterpret_cast<sockaddr_in&>(address).sin_port);
}

void Prepare(int connection) {
  const int on = 1;
  setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  setsockopt(connection, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof(on));
  setsockopt(connection, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof(kSendBuffer));
  setsockopt(connection, IPPROTO_TCP, TCP_USER_TIMEOUT, &kUserTimeoutMs, sizeof(kUserTimeoutMs));
}

}  // namespace

std::string WhyNotListening(int error) {
  if (error == EADDRINUSE) return "the port is in use";
  if (error == EADDRNOTAVAIL) return "the address is not this machine's";
  return std::strerror(error);
}

absl::StatusOr<std::unique_ptr<ListeningSocket>> ListeningSocket::Open(const char* option,
                                                                       const std::string& host,
                                                                       int port) {
  const bool bracketed = host.starts_with('[') && host.ends_with(']');
  const std::string name = bracketed ? host.substr(1, host.size() - 2) : host;
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* addresses = nullptr;
  int descriptor = -1;
  std::string why;
  const int unknown = getaddrinfo(name.c_str(), absl::StrCat(port).c_str(), &hints, &addresses);
  if (unknown != 0) {
    why = gai_strerror(unknown);
  } else {
    for (const addrinfo* one = addresses; one != nullptr && descriptor < 0; one = one->ai_next) {
      descriptor = Listen(*one);
      if (descriptor < 0) why = WhyNotListening(errno);
    }
    freeaddrinfo(addresses);
  }
  if (descriptor < 0) {
    return absl::UnavailableError(
        absl::StrFormat("%s: cannot listen on %s:%d: %s", option, host, port, why));
  }
  const int stop = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  POLYEST_CHECK(stop >= 0);
  return std::unique_ptr<ListeningSocket>(
      new ListeningSocket(descriptor, stop, PortOf(descriptor)));
}

ListeningSocket::~ListeningSocket() {
  close(descriptor_);
  close(stop_);
}

int ListeningSocket::Accept() const {
  while (true) {
    pollfd waiting[] = {{descriptor_, POLLIN, 0}, {stop_, POLLIN, 0}};
    if (poll(waiting, 2, -1) < 0) continue;
    if (waiting[1].revents != 0) return -1;
    const int connection = accept4(descriptor_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (connection >= 0) {
      Prepare(connection);
      return connection;
    }
    if (errno != EAGAIN && errno != EINTR && errno != ECONNABORTED) poll(&waiting[1], 1, kPauseMs);
  }
}

void ListeningSocket::Stop() const {
  const uint64_t one = 1;
  (void)!write(stop_, &one, sizeof(one));
}

}  // namespace polyest::internal
