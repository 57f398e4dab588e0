#include "server/net/socket_address.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

namespace polyest::internal {
namespace {

sockaddr_storage SixAddress(const char* text) {
  sockaddr_storage address{};
  address.ss_family = AF_INET6;
  EXPECT_EQ(inet_pton(AF_INET6, text, &reinterpret_cast<sockaddr_in6&>(address).sin6_addr), 1);
  SetPort(address, 50'051);
  return address;
}

TEST(ToIpAddress, TellsAClientOfIPv4ThatHasReachedASocketOfIPv6) {
  const IpAddress mapped = ToIpAddress(SixAddress("::ffff:192.0.2.7"));
  EXPECT_EQ(mapped.host, "192.0.2.7");
  EXPECT_EQ(mapped.port, 50'051);
  EXPECT_FALSE(mapped.ipv6);
  const IpAddress six = ToIpAddress(SixAddress("2001:db8::7"));
  EXPECT_EQ(six.host, "2001:db8::7");
  EXPECT_EQ(six.port, 50'051);
  EXPECT_TRUE(six.ipv6);
}

TEST(ToIpAddress, HasNoHostForOtherSockets) {
  sockaddr_storage local{};
  local.ss_family = AF_UNIX;
  EXPECT_EQ(ToIpAddress(local).host, "");
}

}  // namespace
}  // namespace polyest::internal
