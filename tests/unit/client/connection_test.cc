#include "polyest/connection.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <optional>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "polyest/client.h"
#include "polyest/rpc/error_details.pb.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal::connection_test {
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
    EXPECT_THAT(refusal, HasSubstr("tokens are sent only over TLS"));
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

// Makes the status as gRPC 1.51 words it.
absl::Status NoConnection(const std::string& reason) {
  return absl::UnavailableError(
      "failed to connect to all addresses; last error: UNKNOWN: ipv4:127.0.0.1:1: " + reason);
}

std::string Hinted(const std::string& reason, const std::optional<ClientTls>& tls) {
  return std::string(WithConnectionHint(NoConnection(reason), tls).message());
}

TEST(ConnectionHint, SaysWhatToLookAtWhereTheTwoEndsDifferInTls) {
  const ClientTls tls{.ca_file = "ca.pem"};
  const ClientTls own{.ca_file = "ca.pem", .certificate_file = "a.pem", .key_file = "a.key"};
  const std::string ssl = "Ssl handshake failed: SSL_ERROR_SSL: error:0A000086:SSL routines::";
  EXPECT_THAT(Hinted("Socket closed", std::nullopt), HasSubstr("give its CA with --tls-ca"));
  EXPECT_THAT(Hinted(ssl + "wrong version number", tls), HasSubstr("does not use TLS"));
  EXPECT_THAT(Hinted(ssl + "certificate verify failed", tls), HasSubstr("not of the CA in"));
  EXPECT_THAT(Hinted("Socket closed", tls), HasSubstr("give yours with --tls-certificate"));
  EXPECT_THAT(Hinted("Socket closed", own), HasSubstr("the daemon's --tls-client-ca"));
}

TEST(ConnectionHint, IsNotGivenWhereTlsIsNotTheReason) {
  const absl::Status refused = NoConnection("Failed to connect to remote host: Connection refused");
  EXPECT_EQ(WithConnectionHint(refused, std::nullopt), refused);
  EXPECT_EQ(WithConnectionHint(refused, ClientTls{}), refused);
  // The connection existed and then closed.
  EXPECT_EQ(WithConnectionHint(absl::UnavailableError("Socket closed"), std::nullopt),
            absl::UnavailableError("Socket closed"));
}

TEST(Client, FailsEveryCallWithWhatIsWrongWithItsOptions) {
  Client client("rig.example.org:1", {.token = "secret"});
  EXPECT_EQ(client.ListModels({}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(client.WatchSession({}, [](const v1::WatchSessionResponse&) { return true; }).code(),
            absl::StatusCode::kInvalidArgument);
}

// Accepts connections and never answers.
class SilentServer {
 public:
  SilentServer() : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(place);
    auto* const address = reinterpret_cast<sockaddr*>(&place);
    POLYEST_CHECK(bind(socket_, address, size) == 0);
    POLYEST_CHECK(listen(socket_, 8) == 0);
    POLYEST_CHECK(getsockname(socket_, address, &size) == 0);
    address_ = absl::StrCat("127.0.0.1:", ntohs(place.sin_port));
  }
  ~SilentServer() { close(socket_); }
  SilentServer(const SilentServer&) = delete;
  SilentServer& operator=(const SilentServer&) = delete;

  const std::string& address() const { return address_; }

 private:
  const int socket_;
  std::string address_;
};

TEST(Client, GivesUpEveryKindOfCallAtTheDeadline) {
  const SilentServer server;
  Client client(server.address(), {.deadline = std::chrono::milliseconds(1)});
  const auto records = []() -> absl::StatusOr<std::optional<v1::SessionRecord>> {
    return v1::SessionRecord();
  };
  EXPECT_TRUE(absl::IsDeadlineExceeded(client.ListModels({}).status()));
  EXPECT_TRUE(absl::IsDeadlineExceeded(
      client.WatchSession({}, [](const v1::WatchSessionResponse&) { return true; })));
  EXPECT_TRUE(absl::IsDeadlineExceeded(
      client.ExportSession({}, [](const v1::SessionRecord&) { return absl::OkStatus(); })));
  EXPECT_TRUE(absl::IsDeadlineExceeded(client.ImportSession("rig", records).status()));
}

// Returns the status of a call as gRPC gives it when a daemon refuses a field.
absl::Status RefusedByDaemon(const std::string& field, const std::string& message) {
  rpc::BadRequest violations;
  violations.add_field_violations()->set_field(field);
  rpc::Status detailed;
  detailed.set_code(grpc::StatusCode::INVALID_ARGUMENT);
  detailed.set_message(message);
  auto& detail = *detailed.add_details();
  detail.set_type_url("type.googleapis.com/google.rpc.BadRequest");
  detail.set_value(violations.SerializeAsString());
  return FromGrpc({grpc::StatusCode::INVALID_ARGUMENT, message, detailed.SerializeAsString()});
}

TEST(FromGrpc, TellsTheFieldFromTheSentence) {
  const absl::Status shown = RefusedByDaemon("sessionId", "sessionId: \"A\" must be short");
  EXPECT_EQ(shown.message(), "sessionId: \"A\" must be short");
  EXPECT_EQ(SentenceOf(shown), "\"A\" must be short");
  EXPECT_EQ(FieldOf(shown)->ToString(), "sessionId");
  const absl::Status in_words = RefusedByDaemon("measurements.timeS[1]", "row 1: 1 after 2");
  EXPECT_EQ(in_words.message(), "row 1: 1 after 2");
  EXPECT_EQ(FieldOf(in_words)->ToString(), "measurements.timeS[1]");
}

}  // namespace
}  // namespace polyest::internal::connection_test
