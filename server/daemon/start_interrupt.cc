#include "server/daemon/start_interrupt.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// Ends the process by a signal that is blocked, so that whoever waits for it sees that.
void EndBy(int number) {
  signal(number, SIG_DFL);
  sigset_t one;
  sigemptyset(&one);
  sigaddset(&one, number);
  pthread_sigmask(SIG_UNBLOCK, &one, nullptr);
  raise(number);
}

}  // namespace

StartInterrupt::StartInterrupt(const sigset_t& signals)
    : signals_(signalfd(-1, &signals, SFD_CLOEXEC)), over_(eventfd(0, EFD_CLOEXEC)) {
  POLYEST_CHECK(signals_.number() >= 0 && over_.number() >= 0);
  thread_ = std::jthread([this] { Wait(); });
}

StartInterrupt::~StartInterrupt() {
  eventfd_write(over_.number(), 1);
  thread_.join();
}

void StartInterrupt::Wait() const {
  pollfd waits[] = {{signals_.number(), POLLIN, 0}, {over_.number(), POLLIN, 0}};
  while (poll(waits, 2, -1) < 0) {
  }
  if (waits[1].revents != 0) return;
  signalfd_siginfo info{};
  if (read(signals_.number(), &info, sizeof(info)) == sizeof(info)) {
    EndBy(static_cast<int>(info.ssi_signo));
  }
}

}  // namespace polyest::internal
