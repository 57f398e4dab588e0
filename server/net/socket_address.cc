#include "server/net/socket_address.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <cstdint>

namespace polyest::internal {

IpAddress ToIpAddress(const sockaddr_storage& address) {
  char text[INET6_ADDRSTRLEN] = "";
  if (address.ss_family == AF_INET) {
    const auto& four = reinterpret_cast<const sockaddr_in&>(address);
    inet_ntop(AF_INET, &four.sin_addr, text, sizeof(text));
    return {text, ntohs(four.sin_port), false};
  }
  if (address.ss_family != AF_INET6) return {};
  const auto& six = reinterpret_cast<const sockaddr_in6&>(address);
  const bool mapped = IN6_IS_ADDR_V4MAPPED(&six.sin6_addr);
  if (mapped) {
    inet_ntop(AF_INET, &six.sin6_addr.s6_addr[12], text, sizeof(text));
  } else {
    inet_ntop(AF_INET6, &six.sin6_addr, text, sizeof(text));
  }
  return {text, ntohs(six.sin6_port), !mapped};
}

socklen_t SizeOf(const sockaddr_storage& address) {
  return address.ss_family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
}

void SetPort(sockaddr_storage& address, int port) {
  const in_port_t wire = htons(static_cast<uint16_t>(port));
  if (address.ss_family == AF_INET) {
    reinterpret_cast<sockaddr_in&>(address).sin_port = wire;
  } else {
    reinterpret_cast<sockaddr_in6&>(address).sin6_port = wire;
  }
}

}  // namespace polyest::internal
