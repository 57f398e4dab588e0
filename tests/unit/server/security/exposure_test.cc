#include "server/security/exposure.h"

#include <gtest/gtest.h>

#include "proto/wire/transport/loopback.h"

namespace polyest::internal {
namespace {

TEST(Exposure, KnowsLoopback) {
  for (const char* host : {"localhost", "LocalHost", "127.0.0.1", "127.255.0.3", "::1", "[::1]"}) {
    EXPECT_TRUE(IsLoopback(host)) << host;
  }
  for (const char* host : {"", "0.0.0.0", "128.0.0.1", "12.7.0.1", "10.0.0.1", "::", "[::]",
                           "[::2]", "127.0.0.1.example.org", "localhost.example.org", "127.1",
                           "[::ffff:127.0.0.1]", "[127.0.0.1]", "example.org"}) {
    EXPECT_FALSE(IsLoopback(host)) << host;
  }
}

TEST(Exposure, NeedsTlsAndAuthenticationBeyondLoopback) {
  EXPECT_TRUE(CheckExposure({.host = "127.0.0.1"}).ok());
  EXPECT_TRUE(CheckExposure({.host = "127.0.0.1", .authentication = true}).ok());
  EXPECT_TRUE(CheckExposure({.host = "0.0.0.0", .tls = true, .authentication = true}).ok());
  EXPECT_TRUE(CheckExposure({.host = "0.0.0.0", .insecure = true}).ok());
}

TEST(Exposure, SaysWhatIsMissing) {
  EXPECT_EQ(CheckExposure({.host = "0.0.0.0"}).message(),
            "--listen: 0.0.0.0 is beyond loopback, which needs --tls-certificate and --tls-key, "
            "and --tokens or --tls-client-ca; --insecure does without");
  EXPECT_EQ(CheckExposure({.host = "[::]", .authentication = true}).message(),
            "--listen: [::] is beyond loopback, which needs --tls-certificate and --tls-key; "
            "--insecure does without");
  EXPECT_EQ(CheckExposure({.host = "rig", .tls = true}).message(),
            "--listen: rig is beyond loopback, which needs --tokens or --tls-client-ca; "
            "--insecure does without");
}

}  // namespace
}  // namespace polyest::internal
