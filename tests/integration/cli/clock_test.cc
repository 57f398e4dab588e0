// Tests a daemon while the clock of its machine is set.

#include <gmock/gmock.h>
#include <stdlib.h>

#include <ctime>

#include "polyest/client.h"
#include "polyest/problem_file.h"
#include "tests/integration/cli/command_test.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kJumpS = 400 * 86'400;

class ClockTest : public CommandTest {
 protected:
  // Starts a daemon under libfaketime, which reads its offset from a file at each look at the
  // clock.
  std::unique_ptr<DaemonProcess> StartDaemon() {
    SetClock("+0");
    const std::vector<std::pair<const char*, std::string>> variables = {
        {"LD_PRELOAD", POLYEST_LIBFAKETIME},
        {"FAKETIME_TIMESTAMP_FILE", folder_ / "clock"},
        {"FAKETIME_NO_CACHE", "1"},
        {"FAKETIME_DONT_FAKE_MONOTONIC", "1"}};
    for (const auto& [name, value] : variables) setenv(name, value.c_str(), 1);
    auto daemon = std::make_unique<DaemonProcess>();
    for (const auto& [name, value] : variables) unsetenv(name);
    return daemon;
  }
  void SetClock(const std::string& offset) const { File("clock", offset + "\n"); }

  // Creates a session and returns the daemon's answer.
  static v1::Session Created(Client& client) {
    v1::CreateSessionRequest create;
    *create.mutable_session()->mutable_problem() = *ReadProblemFile(Example("oscillator.json"));
    const auto session = client.CreateSession(create);
    EXPECT_TRUE(session.ok()) << session.status();
    return session.ok() ? *session : v1::Session();
  }
};

TEST_F(ClockTest, MayBeSetForwardsAndBackUnderAStream) {
  const auto daemon = StartDaemon();
  Client client(daemon->address(), {.deadline = std::chrono::minutes(1)});
  Process process({POLYEST_PROGRAM, "stream", Example("oscillator.json"), "-", "--server",
                   daemon->address(), "--batch", "30", "--format", "jsonl"});
  process.Write(DemoRows(30));
  EXPECT_THAT(process.ReadLine(), HasSubstr("\"sequence\":\"1\""));

  SetClock("+400d");
  process.Write(DemoRows(60).substr(DemoRows(30).size()));
  EXPECT_THAT(process.ReadLine(), HasSubstr("\"sequence\":\"2\""));
  const v1::Session late = Created(client);
  EXPECT_NEAR(static_cast<double>(late.create_time().seconds() - std::time(nullptr)), kJumpS, 3600);
  EXPECT_LT(late.activity().idle_time_s(), 60);

  SetClock("-400d");
  const v1::Session early = Created(client);
  EXPECT_NEAR(static_cast<double>(early.create_time().seconds() - std::time(nullptr)), -kJumpS,
              3600);
  process.Write(DemoRows(90).substr(DemoRows(60).size()));
  process.CloseInput();
  const std::vector<std::string> estimates = Lines(process.ReadAll());
  EXPECT_EQ(process.Wait(), 0) << process.Errors();
  EXPECT_EQ(process.Errors(), "");

  const DaemonProcess undisturbed;
  const Finished run = Run({"stream", Example("oscillator.json"), "-", "--server",
                            undisturbed.address(), "--batch", "30", "--format", "jsonl"},
                           DemoRows(90));
  EXPECT_EQ(estimates.back(), Lines(run.out).back());
}

}  // namespace
}  // namespace polyest::internal
