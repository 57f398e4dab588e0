#include "server/daemon/listen_address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(ListenAddress, TakesNamesIpv4AndBracketedIpv6) {
  for (const char* text : {"127.0.0.1:50051", "localhost:0", "[::1]:65535", "0.0.0.0:1"}) {
    const auto address = ListenAddress::Parse(text);
    ASSERT_TRUE(address.ok()) << address.status();
    EXPECT_EQ(address->ToString(), text);
  }
  EXPECT_EQ(ListenAddress::Parse("[::1]:17")->host, "[::1]");
  EXPECT_EQ(ListenAddress::Parse("[::1]:17")->port, 17);
}

TEST(ListenAddress, RefusesEverythingElse) {
  for (const char* text : {"", ":", "localhost", "localhost:", ":50051", "localhost:65536",
                           "localhost:-1", "localhost:+1", "localhost:1x", "::1:50051", "[::1:1",
                           "[]:1", "unix:/tmp/x", "a b:1", "localhost:000001"}) {
    const auto address = ListenAddress::Parse(text);
    EXPECT_EQ(address.status().code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(address.status().message()),
                testing::StartsWith("--listen: \"" + std::string(text) + "\" must be HOST:PORT"));
  }
}

}  // namespace
}  // namespace polyest::internal
