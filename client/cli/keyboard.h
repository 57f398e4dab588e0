#pragma once

// Reads single keys from the terminal.

#include <chrono>

#include "client/cli/interrupt.h"

namespace polyest::internal {

// Sets the terminal to deliver keys one by one, without echo, while the object exists. If the
// standard input is no terminal or the process is not in its foreground, no keys are read. The
// terminal's mode is restored by the destructor, at the first Ctrl-C (Interrupt), and before
// SIGTERM, SIGHUP or SIGQUIT end the process. Only one object may exist at a time.
class Keyboard {
 public:
  Keyboard();
  ~Keyboard();
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;

  // Returns whether keys can be read.
  bool active() const { return active_; }

  // Waits until `time`, for `q` or for an interrupt. Returns whether `q` was pressed.
  bool WaitForQuit(std::chrono::steady_clock::time_point time, const Interrupt& interrupt);

 private:
  bool ReadQuit();

  bool active_ = false;
};

// Restores the terminal's mode if a Keyboard has changed it. A signal handler may call it.
void RestoreTerminal();

}  // namespace polyest::internal
