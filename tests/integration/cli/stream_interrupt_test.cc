// Tests what Ctrl-C does to `polyest stream`.

#include <gmock/gmock.h>

#include "polyest/client.h"
#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class StreamInterruptTest : public CommandTest {};

TEST_F(StreamInterruptTest, EndsAPipeInOrder) {
  const DaemonProcess daemon;
  Process process(
      {POLYEST_PROGRAM, "stream", Example("oscillator.json"), "-", "--server", daemon.address()});
  process.Write(DemoRows(60));
  // The first estimate has come; the input stays open.
  EXPECT_THAT(process.ReadLine(), StartsWith("t = 1.5 s"));
  process.Signal(SIGINT);
  EXPECT_THAT(process.ReadAll(), HasSubstr("samples up to t = "));
  EXPECT_EQ(process.Wait(), 0) << process.Errors();
}

TEST_F(StreamInterruptTest, SaysWhatHasBeenSentOfAFile) {
  const std::string data = File("d.csv", DemoRows(6000));
  const DaemonProcess daemon;
  Process process({POLYEST_PROGRAM, "stream", Example("oscillator.json"), data, "--server",
                   daemon.address(), "--rate", "1", "--batch", "2"});
  EXPECT_THAT(process.ReadLine(), StartsWith("t = "));
  process.Signal(SIGINT);
  EXPECT_THAT(process.ReadAll(), HasSubstr("samples up to t = "));
  EXPECT_EQ(process.Wait(), 1);
  EXPECT_THAT(Lines(process.Errors()).back(),
              AllOf(StartsWith("polyest: interrupted: the estimate is of the first "),
                    EndsWith(" rows of " + data)));
}

TEST_F(StreamInterruptTest, EndsTheWaitForRoomForASession) {
  DaemonProcess daemon({"--max-memory-mb", "1"});
  Process process(
      {POLYEST_PROGRAM, "stream", Example("oscillator.json"), "-", "--server", daemon.address()});
  process.Write(DemoRows(30));
  Client client(daemon.address());
  while (process.Errors().find("cannot create a session now") == std::string::npos) {
    ASSERT_TRUE(client.GetStatus({}).ok());
  }
  process.Signal(SIGINT);
  EXPECT_EQ(process.Wait(), 1);
  EXPECT_THAT(process.Errors(), HasSubstr("(--max-memory-mb)"));
  EXPECT_EQ(Lines(process.Errors()).back(), "polyest: interrupted before the first estimate");
}

}  // namespace
}  // namespace polyest::internal
