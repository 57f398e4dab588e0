#pragma once

// Single keys from the terminal.

#include <chrono>

#include "client/cli/interrupt.h"

namespace polyest::internal {

// Lets keys be read one by one and unseen while it lives, if the standard input is a terminal and
// the process is in its foreground; otherwise there are no keys. The terminal's mode is restored on
// every way out: at the end, at the first Ctrl-C (Interrupt), and before SIGTERM, SIGHUP or SIGQUIT
// end the process. One at a time.
class Keyboard {
 public:
  Keyboard();
  ~Keyboard();
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;

  // Returns whether there are keys.
  bool active() const { return active_; }

  // Waits until `time`, a `q` or an interrupt. Returns true for a `q`.
  bool WaitForQuit(std::chrono::steady_clock::time_point time, const Interrupt& interrupt);

 private:
  bool ReadQuit();

  bool active_ = false;
};

// Restores the terminal's mode if a Keyboard has changed it. May be called by a signal handler.
void RestoreTerminal();

}  // namespace polyest::internal
