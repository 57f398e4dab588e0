#include "server/security/peer.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(Peer, IsTheEdgeOnLoopbackOnly) {
  for (const char* peer : {"ipv4:127.0.0.1:4711", "ipv6:[::1]:4711", "ipv6:%5B::1%5D:4711"}) {
    EXPECT_TRUE(IsLoopbackPeer(peer)) << peer;
  }
  for (const char* peer : {"ipv4:192.0.2.7:127", "ipv6:[2001:db8::1]:1", "ipv6:%5B2001::1%5D:1",
                           "unix:", "", "127.0.0.1:1", "ipv4:1270.0.0.1:1"}) {
    EXPECT_FALSE(IsLoopbackPeer(peer)) << peer;
  }
}

}  // namespace
}  // namespace polyest::internal
