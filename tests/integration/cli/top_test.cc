// Tests `polyest top` against a daemon.

#include <gmock/gmock.h>

#include "polyest/client.h"
#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;
using ::testing::StartsWith;

class TopTest : public CommandTest {
 protected:
  Finished Stream(const std::string& session) {
    return Run({"stream", Example("oscillator.json"), File("d.csv", DemoRows(60)), "--server",
                daemon_.address(), "--session", session});
  }

  DaemonProcess daemon_;
};

TEST_F(TopTest, ShowsTheDaemonAndItsSessionsOnce) {
  ASSERT_EQ(Stream("rig-1").exit_status, 0);
  ASSERT_EQ(Stream("rig-2").exit_status, 0);
  const Finished top = Run({"top", "--server", daemon_.address(), "--once"});
  ASSERT_EQ(top.exit_status, 0) << top.err;
  const auto lines = Lines(top.out);
  ASSERT_EQ(lines.size(), 6u) << top.out;
  EXPECT_THAT(
      lines[0],
      MatchesRegex("polyestd [0-9.]+, up [0-9]+ s, .* MiB of memory, sessions on disk: .* KiB"));
  EXPECT_THAT(lines[1], StartsWith("2 sessions, 2 loaded, "));
  EXPECT_THAT(lines[3], StartsWith("session"));
  // The session has 60 rows in batches of 30, and an estimate after each batch.
  EXPECT_THAT(lines[4], MatchesRegex("rig-1 +2 +60 +- +2 +[0-9]+ +[0-9.e+]+ .*"));
  EXPECT_THAT(lines[5], StartsWith("rig-2"));
  EXPECT_THAT(top.out, Not(HasSubstr("\x1b")));
}

TEST_F(TopTest, FollowsThePages) {
  // The daemon's pages have 50 sessions.
  Client client(daemon_.address());
  v1::CreateSessionRequest request;
  std::ifstream in(Example("oscillator.json"));
  std::ostringstream problem;
  problem << in.rdbuf();
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(
                  problem.str(), request.mutable_session()->mutable_problem())
                  .ok());
  for (int i = 0; i < 51; ++i) ASSERT_TRUE(client.CreateSession(request).ok());
  const Finished top = Run({"top", "--server", daemon_.address(), "--once"});
  EXPECT_EQ(Lines(top.out).size(), 4u + 51u);
}

TEST_F(TopTest, LooksAgainUntilItIsInterrupted) {
  ASSERT_EQ(Stream("rig").exit_status, 0);
  Process top({POLYEST_PROGRAM, "top", "--server", daemon_.address(), "--interval", "0.1"});
  int looks = 0;
  while (looks < 2) {
    if (top.ReadLine().rfind("polyestd ", 0) == 0) ++looks;
  }
  top.Signal(SIGINT);
  top.ReadAll();
  EXPECT_EQ(top.Wait(), 0) << top.Errors();
}

TEST_F(TopTest, SaysThatTheDaemonIsNotThere) {
  const std::string address = daemon_.address();
  daemon_.Kill();
  const Finished top = Run({"top", "--server", address, "--once", "--deadline", "10"});
  EXPECT_EQ(top.exit_status, 3);
  EXPECT_THAT(top.err, StartsWith("polyest: "));
}

}  // namespace
}  // namespace polyest::internal
