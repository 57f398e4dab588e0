#include "client/cli/interrupt.h"

#include <gtest/gtest.h>
#include <signal.h>

namespace polyest::internal::interrupt_test {
namespace {

void (*ActionOfSigint())(int) {
  struct sigaction action = {};
  sigaction(SIGINT, nullptr, &action);
  return action.sa_handler;
}

TEST(Interrupt, IsRequestedByTheSignal) {
  {
    const Interrupt interrupt;
    EXPECT_FALSE(interrupt.Requested());
    raise(SIGINT);
    EXPECT_TRUE(interrupt.Requested());
  }
  EXPECT_EQ(ActionOfSigint(), SIG_DFL);
}

// A shell starts what is in the background of a script so.
TEST(Interrupt, IsNotRequestedWhereTheSignalIsIgnored) {
  signal(SIGINT, SIG_IGN);
  {
    const Interrupt interrupt;
    raise(SIGINT);
    EXPECT_FALSE(interrupt.Requested());
    EXPECT_EQ(ActionOfSigint(), SIG_IGN);
  }
  EXPECT_EQ(ActionOfSigint(), SIG_IGN);
  signal(SIGINT, SIG_DFL);
}

}  // namespace
}  // namespace polyest::internal::interrupt_test
