// Tests every method with every kind of caller.

#include <absl/strings/match.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "server/security/method_roles.h"
#include "tests/integration/daemon_fixture.h"
#include "tests/integration/security_fixture.h"

namespace polyest::internal {
namespace {

using grpc::StatusCode;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

class AuthenticationTest : public SecureDaemonTest {
 protected:
  // Calls every method with an empty request.
  template <typename Expectation>
  void ForEveryMethod(const std::shared_ptr<grpc::Channel>& channel, const std::string& token,
                      const Expectation& expect) {
    for (const std::string& method : AllMethods()) {
      SCOPED_TRACE(method);
      expect(method, CallRaw(channel, MethodPath(method), token));
    }
  }

  void ExpectByRole(const std::string& token, Role role) {
    ForEveryMethod(Connect(), token, [role](const std::string& method, const grpc::Status& status) {
      const Role needed = FindMethodRole(method)->needed;
      if (role >= needed) {
        EXPECT_THAT(status.error_code(),
                    Not(AnyOf(StatusCode::UNAUTHENTICATED, StatusCode::PERMISSION_DENIED,
                              StatusCode::UNAVAILABLE, StatusCode::UNIMPLEMENTED)))
            << status.error_message();
      } else {
        EXPECT_EQ(status.error_code(), StatusCode::PERMISSION_DENIED) << status.error_message();
        EXPECT_EQ(status.error_message(), method + " needs the role " + RoleName(needed) +
                                              ", the token has " + RoleName(role));
      }
    });
  }

  void ExpectNoConnection(const std::shared_ptr<grpc::Channel>& channel) {
    ForEveryMethod(channel, admin_.secret, [](const std::string&, const grpc::Status& status) {
      EXPECT_EQ(status.error_code(), StatusCode::UNAVAILABLE) << status.error_message();
    });
  }
};

TEST_F(AuthenticationTest, RefusesEveryMethodWithoutAToken) {
  ForEveryMethod(Connect(), "", [](const std::string&, const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(status.error_message(), "a token is needed");
  });
}

TEST_F(AuthenticationTest, RefusesEveryMethodWithAWrongToken) {
  ForEveryMethod(Connect(), MakeToken(), [](const std::string&, const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(status.error_message(), "the token is not known");
  });
}

TEST_F(AuthenticationTest, LetsAReaderRead) { ExpectByRole(reader_.secret, Role::kReader); }
TEST_F(AuthenticationTest, LetsAWriterWrite) { ExpectByRole(writer_.secret, Role::kWriter); }
TEST_F(AuthenticationTest, LetsAnAdminDoEverythingInATenant) {
  ExpectByRole(admin_.secret, Role::kAdmin);
}
TEST_F(AuthenticationTest, LetsAnOperatorDoEverything) {
  ExpectByRole(operator_.secret, Role::kOperator);
}

TEST_F(AuthenticationTest, HidesTheSessionsOfATenantFromOthers) {
  const auto channel = Connect();
  v1::CreateSessionRequest create;
  create.set_session_id("rig");
  *create.mutable_session()->mutable_problem() = Oscillator();
  ASSERT_TRUE(
      CallRaw(channel, MethodPath("CreateSession"), writer_.secret, create.SerializeAsString())
          .ok());
  int methods = 0;
  for (const std::string& method : AllMethods()) {
    SCOPED_TRACE(method);
    const auto request = AboutTheRig(method);
    if (!request) continue;
    ++methods;
    EXPECT_EQ(CallRaw(channel, MethodPath(method), other_.secret, *request).error_code(),
              StatusCode::NOT_FOUND);
  }
  EXPECT_GE(methods, 15);  // the number of today: the loop does look at sessions
  std::string list;
  EXPECT_TRUE(CallRaw(channel, MethodPath("ListSessions"), other_.secret, "", &list).ok());
  EXPECT_EQ(list, "");
  // Each tenant has session names of its own.
  EXPECT_TRUE(
      CallRaw(channel, MethodPath("CreateSession"), other_.secret, create.SerializeAsString())
          .ok());
  EXPECT_TRUE(
      CallRaw(channel, MethodPath("DeleteSession"), other_.secret, *AboutTheRig("DeleteSession"))
          .ok());
  EXPECT_TRUE(
      CallRaw(channel, MethodPath("GetSession"), reader_.secret, *AboutTheRig("GetSession")).ok());
}

TEST_F(AuthenticationTest, LetsNobodyInWithAnExpiredCertificate) {
  ExpectNoConnection(
      Connect(authority_, authority_.Issue("rig", CertificateAuthority::Validity::kExpired)));
}

TEST_F(AuthenticationTest, LetsNobodyInWithACertificateOfAnotherCa) {
  ExpectNoConnection(Connect(authority_, CertificateAuthority("another CA").Issue("rig")));
}

TEST_F(AuthenticationTest, LetsNobodyInWithoutACertificate) {
  ExpectNoConnection(Connect(authority_, {}));
}

TEST_F(AuthenticationTest, IsNotTrustedByClientsOfAnotherCa) {
  ExpectNoConnection(Connect(CertificateAuthority("another CA"), authority_.Issue("rig")));
}

TEST_F(AuthenticationTest, TakesNoConnectionWithoutTlsAndLogsIt) {
  const auto logged = [this] {
    return absl::StrContains(daemon_->Errors(), "a connection failed in its TLS handshake");
  };
  // The client may notice the end of its connection just before the log does.
  for (int attempt = 0; attempt < 100 && !logged(); ++attempt) {
    ExpectNoConnection(grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
  }
  EXPECT_TRUE(logged()) << daemon_->Errors();
}

TEST_F(AuthenticationTest, LogsWhoWasRefusedAndFromWhere) {
  EXPECT_EQ(CallRaw(Connect(), MethodPath("DeleteSession"), reader_.secret).error_code(),
            StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(CallRaw(Connect(), MethodPath("GetStatus"), "guessed").error_code(),
            StatusCode::UNAUTHENTICATED);
  const std::string log = daemon_->Errors();
  EXPECT_THAT(log, testing::ContainsRegex(
                       "method=DeleteSession tenant=chassis caller=anna peer=ipv4:127.0.0.1:[0-9]+ "
                       "code=PERMISSION_DENIED .*reason=\"DeleteSession needs the role"));
  EXPECT_THAT(log, testing::ContainsRegex(
                       "method=GetStatus peer=ipv4:127.0.0.1:[0-9]+ code=UNAUTHENTICATED "
                       ".*reason=\"the token is not known\""));
  EXPECT_THAT(log, testing::ContainsRegex("ready version=[0-9.]+ listen=127.0.0.1:[0-9]+ tls=yes"));
  EXPECT_THAT(log, Not(HasSubstr("guessed")));
}

TEST_F(AuthenticationTest, TakesNoTwoTokensAtOnce) {
  auto stub = v1::ModelService::NewStub(Connect());
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + admin_.secret);
  context.AddMetadata("authorization", "Bearer " + reader_.secret);
  v1::ListModelsResponse response;
  EXPECT_EQ(stub->ListModels(&context, {}, &response).error_code(), StatusCode::UNAUTHENTICATED);
}

TEST_F(AuthenticationTest, TellsOfItsHealthAndItsContractWithoutAToken) {
  std::string health;
  EXPECT_TRUE(CallRaw(Connect(), "/grpc.health.v1.Health/Check", "", "", &health).ok());
  EXPECT_EQ(health, "\x08\x01");
  EXPECT_TRUE(
      CallRaw(Connect(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", "")
          .ok());
}

TEST(ClientCertificate, MakesAnOperatorOfItsHolderWhereThereAreNoTokens) {
  const TestFolder folder;
  const CertificateAuthority authority("test CA");
  const IssuedCertificate own = authority.Issue("daemon");
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--tls-certificate",
                        folder.Write("daemon.pem", own.certificate), "--tls-key",
                        folder.Write("daemon.key", own.key), "--tls-client-ca",
                        folder.Write("ca.pem", authority.certificate())});
  const IssuedCertificate rig = authority.Issue("rig");
  const auto channel = grpc::CreateChannel(
      daemon.ReadAddress(),
      grpc::SslCredentials({authority.certificate(), rig.key, rig.certificate}));
  for (const std::string& method : AllMethods()) {
    EXPECT_THAT(CallRaw(channel, MethodPath(method), "").error_code(),
                Not(AnyOf(StatusCode::UNAUTHENTICATED, StatusCode::PERMISSION_DENIED,
                          StatusCode::UNAVAILABLE)))
        << method;
  }
}

// Returns the one line that the daemon writes, and checks its exit status.
std::string Refusal(const std::vector<std::string>& arguments, int exit_status) {
  DaemonProcess daemon(arguments);
  EXPECT_EQ(daemon.ReadLine(), "");
  EXPECT_EQ(daemon.Wait(), exit_status);
  const std::string errors = daemon.Errors();
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
  return errors;
}

TEST(Exposure, IsRefusedWithoutTlsAndAuthentication) {
  EXPECT_EQ(Refusal({"--listen", "0.0.0.0:0"}, 2),
            "polyestd: --listen: 0.0.0.0 is beyond loopback, which needs --tls-certificate and "
            "--tls-key, and --tokens or --tls-client-ca; --insecure does without\n");
  EXPECT_THAT(Refusal({"--listen", "[::]:0", "--tokens", "/nowhere/tokens"}, 2),
              HasSubstr("which needs --tls-certificate and --tls-key;"));
}

TEST(Exposure, IsTheUsersOwnWishWithInsecure) {
  DaemonProcess daemon({"--listen", "0.0.0.0:0", "--insecure"});
  EXPECT_THAT(daemon.ReadLine(), testing::StartsWith("listening on 0.0.0.0:"));
}

TEST(SecurityFiles, AreRefusedInOneLineWhenTheyAreNoGood) {
  const TestFolder folder;
  const CertificateAuthority authority("test CA");
  const std::string certificate = folder.Write("daemon.pem", authority.Issue("daemon").certificate);
  const std::string key = folder.Write("daemon.key", authority.Issue("another").key);
  EXPECT_THAT(
      Refusal({"--listen", "127.0.0.1:0", "--tls-certificate", certificate, "--tls-key", key}, 1),
      HasSubstr("--tls-key: " + key + " is not the key of " + certificate));
  const std::string tokens = folder.Write("tokens", "rig1 chassis writer " + MakeToken());
  EXPECT_EQ(Refusal({"--listen", "127.0.0.1:0", "--tokens", tokens}, 1),
            "polyestd: --tokens: " + tokens +
                ", line 1: the SHA-256 of the token must be 64 hexadecimal digits\n");
  EXPECT_THAT(Refusal({"--listen", "127.0.0.1:0", "--tokens", folder.Write("none", "# none\n")}, 1),
              HasSubstr("none: there is no token in it"));
  EXPECT_THAT(Refusal({"--tls-certificate", certificate}, 2), HasSubstr("--tls-key"));
  EXPECT_THAT(Refusal({"--tls-client-ca", certificate}, 2), HasSubstr("--tls-certificate"));
}

TEST(SecurityFiles, AreSaidToBeOpenToAll) {
  const TestFolder folder;
  const std::string tokens = folder.Write("tokens", MakeTokenFor("rig1:chassis:writer")->line);
  for (const auto mode : {std::filesystem::perms(0644), std::filesystem::perms(0640)}) {
    std::filesystem::permissions(tokens, mode);
    DaemonProcess daemon({"--listen", "127.0.0.1:0", "--tokens", tokens});
    ASSERT_NE(daemon.ReadAddress(), "");
    EXPECT_EQ(absl::StrContains(daemon.Errors(), tokens + " is open to all users of this machine"),
              mode == std::filesystem::perms(0644));
  }
}

TEST(NewToken, GivesTheSecretOnStdoutAndItsLineOnStderr) {
  DaemonProcess daemon({"--new-token", "rig1:chassis:writer"});
  const std::string secret = daemon.ReadLine();
  EXPECT_EQ(daemon.ReadLine(), "");
  EXPECT_EQ(daemon.Wait(), 0);
  const auto table = TokenTable::Parse(daemon.Errors(), "tokens");
  ASSERT_TRUE(table.ok()) << table.status();
  ASSERT_TRUE(table->Find(secret));
  EXPECT_EQ(table->Find(secret)->role, Role::kWriter);
  EXPECT_EQ(Refusal({"--new-token", "rig1"}, 2),
            "polyestd: --new-token: \"rig1\" must be NAME:TENANT:ROLE, as in "
            "rig1:chassis:writer\n");
}

}  // namespace
}  // namespace polyest::internal
