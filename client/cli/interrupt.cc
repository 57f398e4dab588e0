#include "client/cli/interrupt.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>

#include "client/cli/keyboard.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

// Pipe into which the signal handler writes a byte. The byte is never read, so that the pipe stays
// readable.
int signal_pipe[2] = {-1, -1};

void OnSignal(int) {
  // The terminal is restored here because a second signal ends the process at once.
  RestoreTerminal();
  const int saved = errno;
  const char byte = 0;
  // The pipe cannot be full: the handler runs once.
  [[maybe_unused]] const auto written = write(signal_pipe[1], &byte, 1);
  errno = saved;
}

}  // namespace

Interrupt::Interrupt() {
  POLYEST_CHECK(signal_pipe[0] == -1);
  POLYEST_CHECK(pipe2(signal_pipe, O_CLOEXEC | O_NONBLOCK) == 0);
  struct sigaction action = {};
  sigaction(SIGINT, nullptr, &action);
  ignored_ = action.sa_handler == SIG_IGN;
  if (ignored_) return;
  action = {};
  action.sa_handler = OnSignal;
  // The first signal restores the default action; interrupted reads are restarted.
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
}

Interrupt::~Interrupt() {
  if (!ignored_) signal(SIGINT, SIG_DFL);
  close(signal_pipe[0]);
  close(signal_pipe[1]);
  signal_pipe[0] = signal_pipe[1] = -1;
}

int Interrupt::descriptor() const { return signal_pipe[0]; }

bool Interrupt::Requested() const {
  pollfd wanted = {descriptor(), POLLIN, 0};
  return poll(&wanted, 1, 0) > 0;
}

void Interrupt::WaitUntil(std::chrono::steady_clock::time_point time) const {
  using std::chrono::milliseconds;
  constexpr milliseconds kMaxWait{3'600'000};
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(time - std::chrono::steady_clock::now());
    if (left <= milliseconds::zero()) return;
    pollfd wanted = {descriptor(), POLLIN, 0};
    if (poll(&wanted, 1, static_cast<int>(std::min(left, kMaxWait).count())) > 0) return;
  }
}

InterruptibleInput::InterruptibleInput(int descriptor, const Interrupt& interrupt)
    : descriptor_(descriptor), interrupt_(interrupt), buffer_(1 << 16) {}

InterruptibleInput::int_type InterruptibleInput::underflow() {
  while (true) {
    pollfd wanted[2] = {{descriptor_, POLLIN, 0}, {interrupt_.descriptor(), POLLIN, 0}};
    if (poll(wanted, 2, -1) < 0 && errno != EINTR) break;
    if ((wanted[1].revents & POLLIN) != 0) return traits_type::eof();
    if (wanted[0].revents == 0) continue;
    const ssize_t count = read(descriptor_, buffer_.data(), buffer_.size());
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count < 0) break;
    if (count == 0) return traits_type::eof();
    setg(buffer_.data(), buffer_.data(), buffer_.data() + count);
    return traits_type::to_int_type(*gptr());
  }
  // A stream turns the exception into its bad bit, which distinguishes it from the end of the data.
  throw std::runtime_error("read error");
}

}  // namespace polyest::internal
