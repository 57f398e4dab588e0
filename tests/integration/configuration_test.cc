// Tests the order of precedence: flag, environment, file, default.

#include <gmock/gmock.h>

#include <fstream>

#include "tests/integration/operations_fixture.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

class ConfigurationTest : public testing::Test {
 protected:
  std::string File(const std::string& text) {
    std::ofstream(file_) << text;
    return file_;
  }

  // Returns the daemon's limit of sessions: the number that a client can create, or 10 if that is
  // less.
  static int MaxSessions(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--listen", "127.0.0.1:0"});
    DaemonProcess daemon(arguments);
    const std::string address = daemon.ReadAddress();
    EXPECT_FALSE(address.empty()) << daemon.Errors();
    const auto stub = v1::SessionService::NewStub(
        grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
    for (int sessions = 0; sessions < 10; ++sessions) {
      grpc::ClientContext context;
      v1::CreateSessionRequest request;
      *request.mutable_session()->mutable_problem() = Oscillator();
      v1::Session session;
      if (!stub->CreateSession(&context, request, &session).ok()) return sessions;
    }
    return 10;
  }

  static void ExpectRefused(const std::vector<std::string>& arguments, const std::string& message) {
    DaemonProcess daemon(arguments);
    EXPECT_EQ(daemon.Wait(), 2);
    EXPECT_THAT(daemon.Errors(), HasSubstr("polyestd: " + message));
    const std::string errors = daemon.Errors();
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
  }

  TestFolder folder_;
  const std::string file_ = folder_ / "polyestd.toml";
};

TEST_F(ConfigurationTest, TakesTheFlagThenTheVariableThenTheFile) {
  const std::string file = File("# a comment\nmax-sessions = 1\n");
  EXPECT_EQ(MaxSessions({}), 10);
  EXPECT_EQ(MaxSessions({"--config", file}), 1);
  {
    const Variable config("POLYESTD_CONFIG", file);
    EXPECT_EQ(MaxSessions({}), 1);
  }
  const Variable variable("POLYESTD_MAX_SESSIONS", "2");
  EXPECT_EQ(MaxSessions({}), 2);
  EXPECT_EQ(MaxSessions({"--config", file}), 2);
  EXPECT_EQ(MaxSessions({"--config", file, "--max-sessions", "3"}), 3);
}

TEST_F(ConfigurationTest, NamesTheFileAndTheKeyThatIsWrong) {
  ExpectRefused({"--config", File("max-sesions = 1\n")},
                file_ + ": there is no key \"max-sesions\"");
  ExpectRefused({"--config", File("[server]\nmax-sessions = 1\n")},
                file_ + ": there is no key \"server.max-sessions\"");
  ExpectRefused({"--config", File("version = true\n")}, file_ + ": there is no key \"version\"");
  ExpectRefused({"--config", File("max-sessions = 0\n")}, file_ + ": max-sessions: ");
  ExpectRefused({"--config", File("log-format = \"xml\"\n")}, file_ + ": log-format: ");
  ExpectRefused({"--config", folder_ / "none.toml"}, folder_ / "none.toml" + ": cannot be read");
}

TEST_F(ConfigurationTest, NamesTheVariableThatIsWrong) {
  const Variable variable("POLYESTD_MAX_SESSIONS", "many");
  ExpectRefused({}, "POLYESTD_MAX_SESSIONS: ");
}

TEST_F(ConfigurationTest, NamesAnOptionThatIsMisspelledAndTheNearest) {
  ExpectRefused({"--max-sesions", "5"},
                "there is no option \"--max-sesions\"; did you mean \"--max-sessions\"?");
  ExpectRefused({"--token-file=tokens"},
                "there is no option \"--token-file\"; polyestd --help lists the options");
}

TEST_F(ConfigurationTest, NamesAVariableThatIsMisspelledAndTheNearest) {
  {
    const Variable variable("POLYESTD_MAX_SESIONS", "1");
    ExpectRefused({},
                  "POLYESTD_MAX_SESIONS: no option has this variable; did you mean "
                  "POLYESTD_MAX_SESSIONS?\n");
  }
  {
    const Variable variable("POLYESTD_COLOUR", "red");
    ExpectRefused({},
                  "POLYESTD_COLOUR: no option has this variable; polyestd --help lists the "
                  "options\n");
  }
  // Kubernetes sets this variable beside a service called polyestd.
  const Variable variable("POLYESTD_SERVICE_HOST", "10.0.0.1");
  EXPECT_EQ(MaxSessions({"--max-sessions", "1"}), 1);
}

TEST_F(ConfigurationTest, HasAnExampleThatIsTaken) {
  DaemonProcess daemon({"--config", POLYEST_SOURCE_DIR "/deploy/polyestd.toml", "--listen",
                        "127.0.0.1:0", "--metrics", "127.0.0.1:0"});
  EXPECT_FALSE(daemon.ReadAddress().empty()) << daemon.Errors();
}

TEST_F(ConfigurationTest, HelpSaysWhatComesFirst) {
  DaemonProcess daemon({"--help"});
  std::string help;
  for (int line = 0; line < 200; ++line) help += daemon.ReadLine() + "\n";
  EXPECT_THAT(help, HasSubstr("POLYESTD_DATA_DIR"));
  EXPECT_THAT(help, HasSubstr("--config"));
  EXPECT_EQ(daemon.Wait(), 0);
}

}  // namespace
}  // namespace polyest::internal
