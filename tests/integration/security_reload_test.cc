// Tests tokens and certificates that change while the daemon serves.

#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "tests/integration/daemon_fixture.h"
#include "tests/integration/security_fixture.h"

namespace polyest::internal {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;
using ::testing::Not;

class SecurityReloadTest : public SecureDaemonTest {
 protected:
  void SetUp() override {
    SecureDaemonTest::SetUp();
    channel_ = Connect();
    sessions_ = v1::SessionService::NewStub(channel_);
  }

  StatusCode ListModels(const std::shared_ptr<grpc::Channel>& channel,
                        const std::string& token) const {
    return CallRaw(channel, MethodPath("ListModels"), token).error_code();
  }

  void CreateRig() {
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + writer_.secret);
    v1::CreateSessionRequest request;
    request.set_session_id("rig");
    *request.mutable_session()->mutable_problem() = Oscillator();
    v1::Session session;
    ASSERT_TRUE(sessions_->CreateSession(&context, request, &session).ok());
  }

  // Waits until the condition holds. Each look makes a call or more, so that no sleep is needed.
  static bool ComesTrue(const std::function<bool()>& holds) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (!holds()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
    }
    return true;
  }

  void Replace(const std::string& name, const std::string& text) const {
    std::filesystem::rename(folder_.Write("next", text), File(name));
  }

  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
};

TEST_F(SecurityReloadTest, TakesNewTokensOnSighup) {
  ASSERT_EQ(ListModels(channel_, reader_.secret), StatusCode::OK);
  const NewToken next = *MakeTokenFor("anna:chassis:reader");
  folder_.Write("tokens", Lines({next}));
  daemon_->Signal(SIGHUP);
  EXPECT_TRUE(ComesTrue([&] { return ListModels(channel_, next.secret) == StatusCode::OK; }));
  EXPECT_EQ(ListModels(channel_, reader_.secret), StatusCode::UNAUTHENTICATED);
}

TEST_F(SecurityReloadTest, TakesNewTokensByItself) {
  const NewToken next = *MakeTokenFor("anna:chassis:reader");
  Replace("tokens", Lines({next}));
  EXPECT_TRUE(ComesTrue([&] { return ListModels(channel_, next.secret) == StatusCode::OK; }));
  EXPECT_EQ(ListModels(channel_, reader_.secret), StatusCode::UNAUTHENTICATED);
}

TEST_F(SecurityReloadTest, EndsAStreamWhoseTokenIsTakenBackAtItsNextMessage) {
  CreateRig();
  ClientStream stream(*sessions_, writer_.secret);
  ASSERT_TRUE(stream.Send("sessions/rig", 1, OscillatorRows(0, 10)));
  stream.ExpectAcknowledgement(1);
  v1::Estimate estimate;
  stream.ExpectEstimate(estimate);
  folder_.Write("tokens", Lines({reader_}));
  daemon_->Signal(SIGHUP);
  ASSERT_TRUE(ComesTrue(
      [&] { return ListModels(channel_, writer_.secret) == StatusCode::UNAUTHENTICATED; }));
  stream.Send("sessions/rig", 2, OscillatorRows(10, 20));
  v1::StreamMeasurementsResponse nothing;
  EXPECT_FALSE(stream.Read(nothing)) << nothing.ShortDebugString();
  EXPECT_EQ(stream.Finish().error_code(), StatusCode::UNAUTHENTICATED);
}

TEST_F(SecurityReloadTest, KeepsTheOldTokensAndWarnsOnceWhenTheNewOnesAreNoGood) {
  folder_.Write("tokens", reader_.line + "\nrig1 chassis " + writer_.secret + "\n");
  const std::string warning = "line 2: a token is NAME TENANT ROLE SHA256, four words";
  EXPECT_TRUE(ComesTrue([&] {
    EXPECT_EQ(ListModels(channel_, admin_.secret), StatusCode::OK);
    return daemon_->Errors().find(warning) != std::string::npos;
  }));
  // The daemon would have read the first files a second time before it reads these.
  Replace("tokens", Lines({writer_}));
  EXPECT_TRUE(ComesTrue(
      [&] { return ListModels(channel_, admin_.secret) == StatusCode::UNAUTHENTICATED; }));
  const std::string errors = daemon_->Errors();
  EXPECT_EQ(errors.find(warning), errors.rfind(warning));
}

TEST_F(SecurityReloadTest, TakesANewCertificateWithoutDroppingAStream) {
  CreateRig();
  ClientStream stream(*sessions_, writer_.secret);
  ASSERT_TRUE(stream.Send("sessions/rig", 1, OscillatorRows(0, 10),
                          [](auto& message) { message.mutable_estimates()->set_only_last(true); }));
  stream.ExpectAcknowledgement(1);

  // The certificate is replaced before its key, one file at a time.
  const CertificateAuthority next("next CA");
  const IssuedCertificate issued = next.Issue("daemon");
  Replace("daemon.pem", issued.certificate);
  Replace("daemon.key", issued.key);

  const IssuedCertificate own = authority_.Issue("rig");
  EXPECT_TRUE(
      ComesTrue([&] { return ListModels(Connect(next, own), reader_.secret) == StatusCode::OK; }));
  EXPECT_EQ(ListModels(Connect(authority_, own), reader_.secret), StatusCode::UNAVAILABLE);
  ASSERT_TRUE(stream.Send("sessions/rig", 2, OscillatorRows(10, 20)));
  stream.ExpectAcknowledgement(2);
}

TEST_F(SecurityReloadTest, KeepsTheOldCertificateWhenTheNewOneIsNoGood) {
  folder_.Write("daemon.pem", "nonsense");
  EXPECT_TRUE(ComesTrue([&] {
    EXPECT_EQ(ListModels(Connect(), reader_.secret), StatusCode::OK);
    return daemon_->Errors().find("has no certificate in PEM form") != std::string::npos;
  }));
  EXPECT_EQ(ListModels(Connect(), reader_.secret), StatusCode::OK);
}

TEST_F(SecurityReloadTest, TakesANewClientCa) {
  const CertificateAuthority next("next CA");
  const IssuedCertificate rig = next.Issue("rig");
  Replace("ca.pem", authority_.certificate() + next.certificate());
  EXPECT_TRUE(ComesTrue(
      [&] { return ListModels(Connect(authority_, rig), reader_.secret) == StatusCode::OK; }));
  EXPECT_EQ(ListModels(Connect(), reader_.secret), StatusCode::OK);
}

// Makes gRPC trace everything that it can.
class SecretsTest : public SecurityReloadTest {
 protected:
  void SetUp() override {
    setenv("GRPC_TRACE", "all", 1);
    setenv("GRPC_VERBOSITY", "debug", 1);
    SecurityReloadTest::SetUp();
    unsetenv("GRPC_TRACE");
    unsetenv("GRPC_VERBOSITY");
  }
};

TEST_F(SecretsTest, AreNeverLogged) {
  const std::string wrong = MakeToken();
  for (const std::string& token : {reader_.secret, wrong}) {
    for (const std::string& method : AllMethods()) CallRaw(Connect(), MethodPath(method), token);
  }
  daemon_->Signal(SIGTERM);
  EXPECT_EQ(daemon_->Wait(), 0);
  const std::string errors = daemon_->Errors();
  EXPECT_THAT(errors, HasSubstr("stopped"));
  for (const std::string& token : {reader_.secret, wrong}) {
    EXPECT_THAT(errors, Not(HasSubstr(token.substr(8, 16))));
  }
  EXPECT_THAT(errors, Not(HasSubstr("PRIVATE KEY")));
}

}  // namespace
}  // namespace polyest::internal
