#pragma once

// Reads and changes the addresses of sockets.

#include <sys/socket.h>

#include <string>

namespace polyest::internal {

// An address of IP and a port.
struct IpAddress {
  std::string host;  // without brackets; empty: the socket is not one of IP
  int port = 0;
  bool ipv6 = false;
};

// Returns what an address says. A client of IPv4 that has reached a socket of IPv6 is one of IPv4.
IpAddress ToIpAddress(const sockaddr_storage& address);
// Returns the bytes of an address of IP.
socklen_t SizeOf(const sockaddr_storage& address);
// Sets the port of an address of IP.
void SetPort(sockaddr_storage& address, int port);

}  // namespace polyest::internal
