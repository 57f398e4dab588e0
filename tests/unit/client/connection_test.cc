#include "client/cpp/connection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cpp/client.h"
#include "tests/testing/test_folder.h"

namespace polyest {
namespace {

using ::testing::HasSubstr;

std::string Refusal(const std::string& server, const ClientOptions& options) {
  const auto connection = DaemonConnection::Open(server, options);
  EXPECT_EQ(connection.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(connection.status().message());
}

TEST(DaemonConnection, SendsATokenToLoopbackWithoutTls) {
  for (const char* server : {"localhost:1", "127.0.0.1:1", "[::1]:1"}) {
    EXPECT_TRUE(DaemonConnection::Open(server, {.token = "secret"}).ok()) << server;
  }
}

TEST(DaemonConnection, SendsNoTokenOverANetworkWithoutTls) {
  for (const char* server : {"rig.example.org:1", "192.0.2.7:1", "[2001:db8::1]:1",
                             "localhost.example.org:1", "rig.example.org/localhost:1"}) {
    const std::string refusal = Refusal(server, {.token = "secret"});
    EXPECT_THAT(refusal, HasSubstr("where a token goes over TLS only"));
    EXPECT_THAT(refusal, testing::Not(HasSubstr("secret")));
    EXPECT_TRUE(DaemonConnection::Open(server, {.tls = ClientTls{}, .token = "secret"}).ok());
    EXPECT_TRUE(DaemonConnection::Open(server, {}).ok());
  }
}

TEST(DaemonConnection, TakesTheTokenOfAFileBeforeAnother) {
  const TestFolder folder;
  EXPECT_TRUE(DaemonConnection::Open(
                  "localhost:1", {.token = "two words", .token_file = folder.Write("t", "one\n")})
                  .ok());
  EXPECT_THAT(Refusal("localhost:1", {.token_file = folder.Write("t", "two words")}),
              HasSubstr("must be one word"));
}

TEST(DaemonConnection, NeedsACertificateWithItsKey) {
  EXPECT_THAT(Refusal("localhost:1", {.tls = ClientTls{.certificate_file = "a.pem"}}),
              HasSubstr("must be given together"));
}

TEST(Client, FailsEveryCallWithWhatIsWrongWithItsOptions) {
  Client client("rig.example.org:1", {.token = "secret"});
  EXPECT_EQ(client.ListModels({}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(client.WatchSession({}, [](const v1::EstimateResponse&) { return true; }).code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace polyest
