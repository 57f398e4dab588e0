#include "client/cli/keyboard.h"

#include <poll.h>
#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace polyest::internal {
namespace {

constexpr std::array<int, 3> kEndingSignals = {SIGTERM, SIGHUP, SIGQUIT};

// State that the signal handlers use.
termios saved_mode;
volatile sig_atomic_t mode_changed = 0;

void OnEndingSignal(int signal_number) {
  RestoreTerminal();
  // SA_RESETHAND has restored the default action.
  raise(signal_number);
}

bool InForeground() { return tcgetpgrp(STDIN_FILENO) == getpgrp(); }

}  // namespace

void RestoreTerminal() {
  if (mode_changed == 0) return;
  const int saved = errno;
  tcsetattr(STDIN_FILENO, TCSANOW, &saved_mode);
  mode_changed = 0;
  errno = saved;
}

Keyboard::Keyboard() {
  // A background process that changes the mode would be stopped.
  if (isatty(STDIN_FILENO) == 0 || !InForeground()) return;
  if (tcgetattr(STDIN_FILENO, &saved_mode) != 0) return;
  struct sigaction action = {};
  action.sa_handler = OnEndingSignal;
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_NODEFER;
  for (const int signal_number : kEndingSignals) sigaction(signal_number, &action, nullptr);
  termios keys = saved_mode;
  // ISIG stays set, so that Ctrl-C and Ctrl-Z still send signals.
  keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  keys.c_cc[VMIN] = 0;
  keys.c_cc[VTIME] = 0;
  // Set before the change, so that a signal in between restores the mode.
  mode_changed = 1;
  active_ = tcsetattr(STDIN_FILENO, TCSANOW, &keys) == 0;
}

Keyboard::~Keyboard() {
  if (mode_changed == 0 && !active_) return;
  RestoreTerminal();
  for (const int signal_number : kEndingSignals) signal(signal_number, SIG_DFL);
}

bool Keyboard::ReadQuit() {
  std::array<char, 64> keys{};
  const ssize_t count = read(STDIN_FILENO, keys.data(), keys.size());
  if (count <= 0) {
    // The end of the input means that the terminal is gone: there will be no more keys.
    active_ = count < 0 && (errno == EINTR || errno == EAGAIN);
    return false;
  }
  return std::any_of(keys.begin(), keys.begin() + count,
                     [](char key) { return key == 'q' || key == 'Q'; });
}

bool Keyboard::WaitForQuit(std::chrono::steady_clock::time_point time, const Interrupt& interrupt) {
  using std::chrono::milliseconds;
  constexpr milliseconds kMaxWait{3'600'000};
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(time - std::chrono::steady_clock::now());
    if (left <= milliseconds::zero()) return false;
    // poll() ignores a negative descriptor.
    pollfd wanted[2] = {{interrupt.descriptor(), POLLIN, 0},
                        {active_ ? STDIN_FILENO : -1, POLLIN, 0}};
    const int ready = poll(wanted, 2, static_cast<int>(std::min(left, kMaxWait).count()));
    if (ready <= 0) continue;
    if (wanted[0].revents != 0) return false;
    if (wanted[1].revents != 0 && ReadQuit()) return true;
  }
}

}  // namespace polyest::internal
