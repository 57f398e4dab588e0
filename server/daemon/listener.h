#pragma once

// Listens on sockets and hands their connections to gRPC. gRPC's own listener has no limit of
// connections, and once the process has no descriptor left it never accepts again; this one refuses
// what is too much and goes on.

#include <absl/status/statusor.h>
#include <grpcpp/server_builder.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "server/daemon/connection_table.h"
#include "server/daemon/listen_address.h"
#include "server/net/listening_sockets.h"
#include "server/telemetry/log_limit.h"

namespace polyest::internal {

// Raises the limit of this process's descriptors as far as it may, and returns it.
int64_t RaiseDescriptorLimit();

// Returns the limits of connections where so many descriptors may be open: those asked for (0: as
// many as there may be, at most 10,000, and half of them by one peer), less if that would not leave
// descriptors for the journal and all else.
ConnectionLimits LimitConnections(int64_t descriptors, int64_t total, int64_t per_peer);

// Returns under which name the connections of an address are counted: an IPv4 address, or the 64
// bits of an IPv6 network, which one machine may use in full.
std::string PeerKey(const sockaddr_storage& address);

class Listener {
 public:
  struct Options {
    ConnectionLimits limits{};
    int64_t descriptors = 1'024;  // that the process may have
  };

  explicit Listener(const Options& options) : options_(options), connections_(options.limits) {}
  // Stops accepting.
  ~Listener() { Stop(); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  // Listens on an address, on all that its name stands for and this machine has, and sets its port
  // if that is 0. UNAVAILABLE, naming the address, when that is not possible.
  absl::Status Listen(ListenAddress& address);
  // Lets the server that is being built take the connections.
  void Serve(grpc::ServerBuilder& builder,
             const std::shared_ptr<grpc::ServerCredentials>& credentials);
  // Accepts connections from here on. The server must have been built.
  void Start();
  // Accepts none from here on. Must come before the server's end.
  void Stop();

  // Connects to every socket that it listens on, as a client does, and returns whether each
  // connection was accepted within `timeout`. If `http2`, the server must also answer a call of its
  // health service there. The limits do not concern these connections. A socket at an address that
  // this machine does not have any more is not tried.
  bool Dial(std::chrono::milliseconds timeout, bool http2);

  // Returns the number of connections that are open, and how many were refused.
  int64_t open() { return connections_.Count(); }
  int64_t refused() const { return refused_; }
  const ConnectionLimits& limits() const { return options_.limits; }

 private:
  void Run();
  void Take(int connection, const sockaddr_storage& from);
  bool TakeOwn(int connection, const std::string& from);
  // Hands a connection to gRPC.
  void Pass(int connection);
  void Refuse(int connection, const std::string& peer, const char* why);
  // Dials one address; nothing if this machine does not have it.
  std::optional<bool> DialOne(const sockaddr_storage& address,
                              std::chrono::steady_clock::time_point deadline, bool http2);

  const Options options_;
  ListeningSockets sockets_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  ConnectionTable connections_;
  std::atomic<int64_t> refused_ = 0;
  LogLimit warnings_{5, 0.2};

  // Own connections that are awaited, by the address and port that they come from, with whether
  // gRPC is to have them; and those that have come.
  std::mutex own_mutex_;
  std::map<std::string, bool> own_;
  std::set<std::string> own_accepted_;
  std::condition_variable own_changed_;

  std::thread thread_;
};

}  // namespace polyest::internal
