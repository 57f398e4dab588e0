#include "server/daemon/listener.h"

#include <absl/strings/str_cat.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <optional>

#include "server/daemon/health_dial.h"
#include "server/net/descriptor.h"
#include "server/net/socket_address.h"
#include "server/telemetry/structured_log.h"

namespace polyest::internal {
namespace {

constexpr int64_t kMaxConnections = 10'000;
// Descriptors that connections do not get: for the journal, FMUs, the metrics and all else.
constexpr int64_t kReserve = 512;

int64_t ReserveOf(int64_t descriptors) { return std::min(kReserve, descriptors / 4); }

// Returns an address and its port as text, which no two connections to a socket share.
std::string TextOf(const sockaddr_storage& address) {
  const IpAddress ip = ToIpAddress(address);
  return absl::StrCat(ip.host, " ", ip.port);
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
  const IpAddress ip = ToIpAddress(address);
  if (ip.host.empty()) return "local";
  if (!ip.ipv6) return ip.host;
  sockaddr_storage network = address;
  auto& bytes = reinterpret_cast<sockaddr_in6&>(network).sin6_addr.s6_addr;
  std::fill(std::begin(bytes) + 8, std::end(bytes), 0);
  return absl::StrCat(ToIpAddress(network).host, "/64");
}

absl::Status Listener::Listen(ListenAddress& address) {
  return sockets_.Listen("--listen", address.host, address.port);
}

void Listener::Serve(grpc::ServerBuilder& builder,
                     const std::shared_ptr<grpc::ServerCredentials>& credentials) {
  acceptor_ = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials);
}

void Listener::Start() {
  thread_ = std::thread([this] { Run(); });
}

void Listener::Stop() {
  if (!thread_.joinable()) return;
  sockets_.Stop();
  thread_.join();
  sockets_.Close();
}

void Listener::Run() {
  while (true) {
    const ListeningSockets::Connection connection = sockets_.Accept();
    if (connection.descriptor < 0) return;
    Take(connection.descriptor, connection.from);
  }
}

// Refuses a connection or hands it to gRPC.
void Listener::Take(int connection, const sockaddr_storage& from) {
  if (TakeOwn(connection, TextOf(from))) return;
  const std::string peer = PeerKey(from);
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
      {{"peer", peer}, {"reason", why}, {"suppressed", SuppressedText(*suppressed)}});
}

bool Listener::Dial(std::chrono::milliseconds timeout, bool http2) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  const std::vector<sockaddr_storage> addresses = sockets_.Addresses();
  return std::all_of(addresses.begin(), addresses.end(), [&](const sockaddr_storage& listening) {
    for (const sockaddr_storage& address : AddressesToDial(listening)) {
      const std::optional<bool> answers = DialOne(address, deadline, http2);
      if (answers) return *answers;
    }
    return true;  // a connection that could not be tried says nothing
  });
}

std::optional<bool> Listener::DialOne(const sockaddr_storage& address,
                                      std::chrono::steady_clock::time_point deadline, bool http2) {
  const Descriptor client(
      ::socket(address.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  // The connection's origin is chosen first, so that it is known when it arrives: the same address,
  // which is this machine's, and any port.
  sockaddr_storage from = address;
  SetPort(from, 0);
  socklen_t size = sizeof(from);
  if (client.number() < 0 ||
      bind(client.number(), reinterpret_cast<sockaddr*>(&from), SizeOf(from)) != 0 ||
      getsockname(client.number(), reinterpret_cast<sockaddr*>(&from), &size) != 0) {
    if (errno == EADDRNOTAVAIL || errno == EAFNOSUPPORT) return std::nullopt;
    return false;
  }
  const std::string place = TextOf(from);
  {
    const std::lock_guard lock(own_mutex_);
    own_[place] = http2;
  }
  const int connected =
      connect(client.number(), reinterpret_cast<const sockaddr*>(&address), SizeOf(address));
  const bool begun = connected == 0 || errno == EINPROGRESS;
  std::unique_lock lock(own_mutex_);
  const bool accepted = begun && own_changed_.wait_until(
                                     lock, deadline, [&] { return own_accepted_.contains(place); });
  own_.erase(place);
  own_accepted_.erase(place);
  lock.unlock();
  return accepted && (!http2 || AnswersHealthCall(client.number(), deadline));
}

}  // namespace polyest::internal
