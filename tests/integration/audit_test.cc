// Tests that the daemon writes down who did what.

#include <gmock/gmock.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "server/security/token_table.h"
#include "tests/integration/operations_fixture.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class AuditTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string tokens = folder_.Write(
        "tokens", admin_.line + "\n" + reader_.line + "\n" + MakeTokenFor("o:t:operator")->line);
    daemon_ = std::make_unique<DaemonProcess>(std::vector<std::string>{
        "--listen", "127.0.0.1:0", "--tokens", tokens, "--audit-log", file_});
    sessions_ = v1::SessionService::NewStub(
        grpc::CreateChannel(daemon_->ReadAddress(), grpc::InsecureChannelCredentials()));
  }

  // Makes one call with a token and a request id.
  template <typename Call>
  grpc::Status As(const std::string& token, const std::string& id, const Call& call) {
    grpc::ClientContext context;
    if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
    context.AddMetadata("x-request-id", id);
    return call(context);
  }
  grpc::Status Delete(const std::string& token, const std::string& id) {
    return As(token, id, [&](grpc::ClientContext& context) {
      v1::DeleteSessionRequest request;
      request.set_name("sessions/rig");
      google::protobuf::Empty empty;
      return sessions_->DeleteSession(&context, request, &empty);
    });
  }
  std::string Text() const {
    std::ifstream in(file_);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  // Returns the line of a request, as soon as it is there.
  google::protobuf::Struct LineOf(const std::string& id) const {
    while (true) {
      const std::string text = Text();
      if (text.ends_with('\n')) {
        for (const auto& line : JsonLines(text)) {
          if (Field(line, "request") == id) return line;
        }
      }
    }
  }

  const TestFolder folder_;
  const std::string file_ = folder_ / "audit.log";
  const NewToken admin_ = *MakeTokenFor("bert:chassis:admin");
  const NewToken reader_ = *MakeTokenFor("anna:chassis:reader");
  std::unique_ptr<DaemonProcess> daemon_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
};

TEST_F(AuditTest, HasWhoCreatedAndDeletedASession) {
  EXPECT_TRUE(As(admin_.secret, "made", [&](grpc::ClientContext& context) {
                v1::CreateSessionRequest request;
                request.set_session_id("rig");
                *request.mutable_session()->mutable_problem() = Oscillator();
                v1::Session session;
                return sessions_->CreateSession(&context, request, &session);
              }).ok());
  EXPECT_TRUE(Delete(admin_.secret, "gone").ok());
  for (const char* id : {"made", "gone"}) {
    const auto line = LineOf(id);
    EXPECT_EQ(Field(line, "event"), "call");
    EXPECT_EQ(Field(line, "session"), "sessions/rig");
    EXPECT_EQ(Field(line, "tenant"), "chassis");
    EXPECT_EQ(Field(line, "caller"), "bert");
    EXPECT_EQ(Field(line, "role"), "admin");
    EXPECT_EQ(Field(line, "code"), "OK");
    EXPECT_THAT(Field(line, "peer"), testing::StartsWith("ipv4:127.0.0.1:"));
    EXPECT_THAT(Field(line, "time"), testing::EndsWith("Z"));
  }
  EXPECT_EQ(Field(LineOf("gone"), "method"), "DeleteSession");
}

TEST_F(AuditTest, HasWhoWasNotLetInAndNoToken) {
  EXPECT_FALSE(Delete(reader_.secret, "by-anna").ok());
  EXPECT_FALSE(Delete("guessed", "by-nobody").ok());
  EXPECT_EQ(Field(LineOf("by-anna"), "caller"), "anna");
  EXPECT_EQ(Field(LineOf("by-anna"), "code"), "PERMISSION_DENIED");
  EXPECT_EQ(Field(LineOf("by-anna"), "reason"),
            "DeleteSession needs the role admin, the token has reader");
  EXPECT_EQ(Field(LineOf("by-nobody"), "code"), "UNAUTHENTICATED");
  EXPECT_THAT(Text(), Not(HasSubstr("guessed")));
  EXPECT_THAT(Text(), Not(HasSubstr(reader_.secret)));
}

TEST_F(AuditTest, GoesOnAfterRotationAndTellsOfItsOwnEnd) {
  EXPECT_FALSE(Delete(reader_.secret, "before").ok());
  LineOf("before");
  std::filesystem::rename(file_, file_ + ".1");
  daemon_->Signal(SIGHUP);
  EXPECT_FALSE(Delete(reader_.secret, "after").ok());
  LineOf("after");
  EXPECT_THAT(Text(), Not(HasSubstr("\"started\"")));
  daemon_->Signal(SIGTERM);
  EXPECT_EQ(daemon_->Wait(), 0);
  EXPECT_THAT(Text(), HasSubstr("\"stopping\""));
}

TEST(AuditOfAFullDisk, StopsNothingAndIsSaid) {
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--audit-log", "/dev/full"});
  auto sessions = v1::SessionService::NewStub(
      grpc::CreateChannel(daemon.ReadAddress(), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  v1::CreateSessionRequest request;
  *request.mutable_session()->mutable_problem() = Oscillator();
  v1::Session session;
  EXPECT_TRUE(sessions->CreateSession(&context, request, &session).ok());
  while (daemon.Errors().find("the audit log /dev/full cannot be written") == std::string::npos) {
  }
  daemon.Signal(SIGTERM);
  EXPECT_EQ(daemon.Wait(), 0);
}

}  // namespace
}  // namespace polyest::internal
