#pragma once

// Listens on TCP ports and accepts their connections.

#include <absl/status/status.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>

#include <cstddef>
#include <string>
#include <vector>

#include "server/net/descriptor.h"
#include "server/telemetry/log_limit.h"

namespace polyest::internal {

// Is used by one thread, but for Stop, stop_descriptor and, before Close, Addresses.
class ListeningSockets {
 public:
  struct Connection {
    int descriptor = -1;  // the caller's, who closes it; −1: there are no more
    sockaddr_storage from{};
  };

  ListeningSockets();

  // Listens on an address: on all that `host`, a name, an IPv4 address, or an IPv6 address in
  // brackets, stands for and this machine has. Sets `port` if it is 0 to one that is free at all of
  // them. UNAVAILABLE when that is not possible, naming the `option` and the address.
  absl::Status Listen(const std::string& option, const std::string& host, int& port);
  // Returns the next connection; none after Stop. A connection that fails before it is accepted,
  // and a lack of descriptors or memory, delay the next one only. Connections of the sockets are
  // accepted in turn, however busy one socket is.
  Connection Accept();
  // Makes Accept return from here on. To be called from any thread.
  void Stop() const;
  // Returns a descriptor that is readable from Stop on.
  int stop_descriptor() const { return stop_.number(); }
  // Refuses clients from here on.
  void Close() { sockets_.clear(); }

  // Returns the addresses that are listened on.
  std::vector<sockaddr_storage> Addresses() const;

 private:
  struct Socket {
    Descriptor descriptor;
    sockaddr_storage address{};
  };

  // Listens on one address and sets `port` to the one that it got; returns 0, or the system's
  // error.
  int Bind(const addrinfo& wanted, int& port);
  // Does so on all of these addresses that the machine has, or on none.
  int BindAll(const addrinfo* addresses, int& port);
  // Waits until a socket has a connection, and returns it; −1 after Stop.
  int Await();

  Descriptor stop_;  // an eventfd
  std::vector<Socket> sockets_;
  std::vector<pollfd> waits_;  // for stop_, then for the sockets
  size_t last_ = 0;            // the socket of the last connection
  LogLimit warnings_{5, 0.2};
};

}  // namespace polyest::internal
