#include "server/daemon/listener.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/common/status.h"
#include "server/daemon/health_dial.h"
#include "server/telemetry/structured_log.h"
#include "server/web/listening_socket.h"

namespace polyest::internal {
namespace {

constexpr int64_t kMaxConnections = 10'000;
// Descriptors that connections do not get: for the journal, FMUs, the metrics and all else.
constexpr int64_t kReserve = 512;
// Number of ports tried until one is free at all addresses of a name.
constexpr int kAttempts = 8;
// Time after which what was sent and not acknowledged ends a connection, ms.
constexpr int kUserTimeoutMs = 20'000;
// Pause where the system itself has no descriptors or memory left for a connection.
constexpr std::chrono::milliseconds kPauseWithoutRoom{10};

int64_t ReserveOf(int64_t descriptors) { return std::min(kReserve, descriptors / 4); }

// The addresses that a name stands for.
struct Resolved {
  addrinfo* first = nullptr;
  ~Resolved() {
    if (first != nullptr) freeaddrinfo(first);
  }
};

void SetOption(int socket, int level, int name, int value) {
  setsockopt(socket, level, name, &value, sizeof(value));
}

int PortOf(const sockaddr_storage& address) {
  return ntohs(address.ss_family == AF_INET
                   ? reinterpret_cast<const sockaddr_in&>(address).sin_port
                   : reinterpret_cast<const sockaddr_in6&>(address).sin6_port);
}

void SetPort(sockaddr* address, int port) {
  const in_port_t wire = htons(static_cast<uint16_t>(port));
  if (address->sa_family == AF_INET) reinterpret_cast<sockaddr_in*>(address)->sin_port = wire;
  if (address->sa_family == AF_INET6) reinterpret_cast<sockaddr_in6*>(address)->sin6_port = wire;
}

// Returns the address that a client on this machine reaches a socket at.
sockaddr_storage Reachable(sockaddr_storage address) {
  auto& four = reinterpret_cast<sockaddr_in&>(address);
  auto& six = reinterpret_cast<sockaddr_in6&>(address);
  if (address.ss_family == AF_INET && four.sin_addr.s_addr == htonl(INADDR_ANY)) {
    four.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  } else if (address.ss_family == AF_INET6 && IN6_IS_ADDR_UNSPECIFIED(&six.sin6_addr)) {
    six.sin6_addr = in6addr_loopback;
  }
  return address;
}

// Returns an address and its port as text, which no two connections to a socket share.
std::string TextOf(const sockaddr_storage& address) {
  char host[NI_MAXHOST] = "", port[NI_MAXSERV] = "";
  getnameinfo(reinterpret_cast<const sockaddr*>(&address), sizeof(address), host, sizeof(host),
              port, sizeof(port), NI_NUMERICHOST | NI_NUMERICSERV);
  return absl::StrCat(host, " ", port);
}

socklen_t SizeOf(const sockaddr_storage& address) {
  return address.ss_family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
}

}  // namespace

int64_t RaiseDescriptorLimit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return 1'024;
  if (limit.rlim_cur < limit.rlim_max) {
    const rlimit raised{limit.rlim_max, limit.rlim_max};
    if (setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
  }
  return static_cast<int64_t>(std::min<rlim_t>(limit.rlim_cur, int64_t{1} << 30));
}

ConnectionLimits LimitConnections(int64_t descriptors, int64_t total, int64_t per_peer) {
  ConnectionLimits limits;
  limits.total = std::min(total > 0 ? total : kMaxConnections,
                          std::max<int64_t>(1, descriptors - ReserveOf(descriptors)));
  limits.per_peer = per_peer > 0 ? per_peer : std::max<int64_t>(1, limits.total / 2);
  return limits;
}

std::string PeerKey(const sockaddr_storage& address) {
  char text[INET6_ADDRSTRLEN] = "";
  if (address.ss_family == AF_INET) {
    inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in&>(address).sin_addr, text, sizeof(text));
    return text;
  }
  if (address.ss_family != AF_INET6) return "local";
  in6_addr six = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
  if (IN6_IS_ADDR_V4MAPPED(&six)) {
    inet_ntop(AF_INET, &six.s6_addr[12], text, sizeof(text));
    return text;
  }
  std::fill(std::begin(six.s6_addr) + 8, std::end(six.s6_addr), 0);
  inet_ntop(AF_INET6, &six, text, sizeof(text));
  return absl::StrCat(text, "/64");
}

Listener::Socket::~Socket() { close(number); }

int Listener::Bind(const sockaddr* address, socklen_t size, int& port) {
  auto socket = std::make_unique<Socket>(
      ::socket(address->sa_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int number = socket->number;
  if (number < 0) return errno;
  // An older daemon's closed connections do not hold the port; a daemon that listens does.
  SetOption(number, SOL_SOCKET, SO_REUSEADDR, 1);
  if (address->sa_family == AF_INET6) SetOption(number, IPPROTO_IPV6, IPV6_V6ONLY, 0);
  // Connections inherit these.
  SetOption(number, IPPROTO_TCP, TCP_NODELAY, 1);
  SetOption(number, IPPROTO_TCP, TCP_USER_TIMEOUT, kUserTimeoutMs);
  sockaddr_storage bound{};
  std::memcpy(&bound, address, size);
  SetPort(reinterpret_cast<sockaddr*>(&bound), port);
  if (bind(number, reinterpret_cast<const sockaddr*>(&bound), size) != 0 ||
      listen(number, SOMAXCONN) != 0) {
    return errno;
  }
  socklen_t bound_size = sizeof(bound);
  if (getsockname(number, reinterpret_cast<sockaddr*>(&bound), &bound_size) != 0) return errno;
  port = PortOf(bound);
  sockets_.push_back(std::move(socket));
  return 0;
}

absl::Status Listener::Listen(ListenAddress& address) {
  const std::string host = address.host.starts_with('[')
                               ? address.host.substr(1, address.host.size() - 2)
                               : address.host;
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  const auto refuse = [&](const std::string& why) {
    return absl::UnavailableError(
        absl::StrFormat("--listen: cannot listen on %s: %s", address.ToString(), why));
  };
  Resolved resolved;
  const int unknown = getaddrinfo(host.c_str(), nullptr, &hints, &resolved.first);
  if (unknown != 0) return refuse(gai_strerror(unknown));
  int port = address.port;
  int error = BindAll(resolved.first, port);
  // A port that is free at the first address may be in use at the second.
  for (int attempt = 1; error == EADDRINUSE && address.port == 0 && attempt < kAttempts;
       ++attempt) {
    error = BindAll(resolved.first, port = 0);
  }
  if (error != 0) return refuse(WhyNotListening(error));
  address.port = port;
  return absl::OkStatus();
}

int Listener::BindAll(const addrinfo* addresses, int& port) {
  const size_t before = sockets_.size();
  int last = 0;
  for (const addrinfo* one = addresses; one != nullptr; one = one->ai_next) {
    last = Bind(one->ai_addr, one->ai_addrlen, port);
    // A machine may lack one of two kinds of addresses; another program must not have one of them.
    if (last != 0 && last != EADDRNOTAVAIL && last != EAFNOSUPPORT) {
      sockets_.resize(before);
      return last;
    }
  }
  return sockets_.size() > before ? 0 : last;
}

void Listener::Serve(grpc::ServerBuilder& builder,
                     const std::shared_ptr<grpc::ServerCredentials>& credentials) {
  acceptor_ = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials);
}

void Listener::Start() {
  wake_ = std::make_unique<Socket>(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  thread_ = std::jthread([this](std::stop_token stop) { Run(std::move(stop)); });
}

void Listener::Stop() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  eventfd_write(wake_->number, 1);
  thread_.join();
  sockets_.clear();
}

void Listener::Run(std::stop_token stop) {
  std::vector<pollfd> waits;
  for (const auto& socket : sockets_) waits.push_back({socket->number, POLLIN, 0});
  waits.push_back({wake_->number, POLLIN, 0});
  while (!stop.stop_requested()) {
    if (poll(waits.data(), waits.size(), -1) < 0) continue;
    for (size_t i = 0; i < sockets_.size(); ++i) {
      if (waits[i].revents != 0) Accept(waits[i].fd);
    }
  }
}

// Accepts one connection, and refuses it or hands it to gRPC.
void Listener::Accept(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  const int connection =
      accept4(socket, reinterpret_cast<sockaddr*>(&address), &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (connection < 0) {
    if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
      if (warnings_.Admit("accept")) {
        spdlog::error("connections cannot be accepted: {}", std::strerror(errno));
      }
      std::this_thread::sleep_for(kPauseWithoutRoom);
    }
    return;
  }
  if (TakeOwn(connection, TextOf(address))) return;
  const std::string peer = PeerKey(address);
  // The lowest free number is given to a new descriptor: this one says how many are in use.
  if (connection >= options_.descriptors - ReserveOf(options_.descriptors) / 2) {
    return Refuse(connection, peer, "descriptors are short");
  }
  switch (connections_.Admit(connection, peer)) {
    case ConnectionTable::Verdict::kTooMany:
      return Refuse(connection, peer, "too many connections are open (--max-connections)");
    case ConnectionTable::Verdict::kTooManyOfPeer:
      return Refuse(connection, peer,
                    "the peer has too many connections open (--max-connections-per-peer)");
    case ConnectionTable::Verdict::kAdmitted:
      return Pass(connection);
  }
}

// Takes a connection if it is one that Dial has made.
bool Listener::TakeOwn(int connection, const std::string& from) {
  const std::lock_guard lock(own_mutex_);
  const auto own = own_.find(from);
  if (own == own_.end()) return false;
  own_accepted_.insert(from);
  own_changed_.notify_all();
  if (own->second) {
    Pass(connection);
  } else {
    close(connection);
  }
  return true;
}

void Listener::Pass(int connection) {
  grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
  parameters.fd = connection;
  acceptor_->HandleNewConnection(&parameters);
}

void Listener::Refuse(int connection, const std::string& peer, const char* why) {
  close(connection);
  ++refused_;
  const auto suppressed = warnings_.Admit(why);
  if (!suppressed) return;
  Log(spdlog::level::warn, "a connection was refused",
      {{"peer", peer},
       {"reason", why},
       {"suppressed", *suppressed > 0 ? absl::StrCat(*suppressed) : ""}});
}

bool Listener::Dial(std::chrono::milliseconds timeout, bool http2) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  return std::all_of(sockets_.begin(), sockets_.end(),
                     [&](const auto& socket) { return DialOne(socket->number, deadline, http2); });
}

bool Listener::DialOne(int listening, std::chrono::steady_clock::time_point deadline, bool http2) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (getsockname(listening, reinterpret_cast<sockaddr*>(&address), &size) != 0) return false;
  address = Reachable(address);
  const Socket client(::socket(address.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  // Where it comes from is chosen first, so that the connection is known when it arrives: the same
  // address, which is this machine's, and any port.
  sockaddr_storage from = address;
  SetPort(reinterpret_cast<sockaddr*>(&from), 0);
  size = sizeof(from);
  if (client.number < 0 ||
      bind(client.number, reinterpret_cast<sockaddr*>(&from), SizeOf(from)) != 0 ||
      getsockname(client.number, reinterpret_cast<sockaddr*>(&from), &size) != 0) {
    return false;
  }
  const std::string place = TextOf(from);
  {
    const std::lock_guard lock(own_mutex_);
    own_[place] = http2;
  }
  const int connected =
      connect(client.number, reinterpret_cast<sockaddr*>(&address), SizeOf(address));
  const bool begun = connected == 0 || errno == EINPROGRESS;
  std::unique_lock lock(own_mutex_);
  const bool accepted = begun && own_changed_.wait_until(
                                     lock, deadline, [&] { return own_accepted_.contains(place); });
  own_.erase(place);
  own_accepted_.erase(place);
  lock.unlock();
  return accepted && (!http2 || AnswersHealthCall(client.number, deadline));
}

}  // namespace polyest::internal
