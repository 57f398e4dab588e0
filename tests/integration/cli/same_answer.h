#pragma once

// A fixture for commands whose answer must be the same in this process and from a daemon.

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/integration/cli/command_test.h"

namespace polyest::internal {

class SameAnswerTest : public CommandTest {
 protected:
  // Runs a command in this process and with a daemon, and compares the answers.
  void ExpectSameAnswer(const std::vector<std::string>& arguments) {
    const Finished local = Run(arguments);
    ASSERT_EQ(local.exit_status, 0) << local.err;
    EXPECT_THAT(local.err, ::testing::IsEmpty());
    EXPECT_FALSE(local.out.empty());
    std::vector<std::string> with_server = arguments;
    with_server.insert(with_server.end(), {"--server", daemon_.address()});
    const Finished remote = Run(with_server);
    ASSERT_EQ(remote.exit_status, 0) << remote.err;
    EXPECT_EQ(local.out, remote.out);
  }

  DaemonProcess daemon_;
};

}  // namespace polyest::internal
