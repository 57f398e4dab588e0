// Tests how the end of a worker is reported.

#include "core/fmu/worker_process.h"

#include <absl/cleanup/cleanup.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <cstdlib>

#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using testing::HasSubstr;

// Runs a shell script as a worker that is asked for something, and returns how it died.
absl::Status Death(const std::string& script) {
  const TestFolder folder;
  const std::string program = folder.Write("worker", "#!/bin/sh\n" + script + "\n");
  chmod(program.c_str(), 0700);
  setenv("POLYEST_FMU_WORKER", program.c_str(), 1);
  const absl::Cleanup unset = [] { unsetenv("POLYEST_FMU_WORKER"); };
  const auto worker = WorkerProcess::Start("rig", {}).value();
  worker->Send("a question");
  worker->AwaitAnswer();
  absl::Status status = worker->Exchange();
  while (status.ok()) {
    pollfd event{worker->socket(), POLLIN, 0};
    poll(&event, 1, -1);
    status = worker->Exchange();
  }
  EXPECT_EQ(worker->pid(), -1);
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "a worker is left";
  return status;
}

// Closes the socket while the script goes on.
constexpr char kBreakOff[] = "exec 3>&-; ";

TEST(WorkerProcess, ThatEndsByItselfIsNotSaidToBeKilled) {
  EXPECT_THAT(Death("exit 7").message(), HasSubstr("fmu rig: the worker ended with status 7"));
  EXPECT_THAT(Death(std::string(kBreakOff) + "exit 7").message(),
              HasSubstr("fmu rig: the worker ended with status 7"));
}

TEST(WorkerProcess, ThatIsKilledIsSaidToBe) {
  EXPECT_THAT(Death("kill -9 $$").message(),
              HasSubstr("the worker was killed by signal 9 (Killed)"));
  EXPECT_THAT(Death(std::string(kBreakOff) + "kill -15 $$").message(),
              HasSubstr("the worker was killed by signal 15 (Terminated)"));
}

TEST(WorkerProcess, ThatGoesOnWithoutItsSocketIsStopped) {
  EXPECT_THAT(Death(std::string(kBreakOff) + "exec tail -f /dev/null").message(),
              HasSubstr("the worker broke off and was stopped"));
}

TEST(WorkerProcess, ThatIsStoppedFromOutsideIsUnavailableAndOneThatFailsIsNot) {
  EXPECT_EQ(Death("kill -9 $$").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Death("kill -15 $$").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Death("kill -11 $$").code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(Death("exit 7").code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace polyest::internal
