#pragma once

#include <chrono>
#include <streambuf>
#include <vector>

namespace polyest::internal {

// Turns Ctrl-C into something to wait for. While it lives the first SIGINT asks for an orderly end
// (and restores the terminal's mode, keyboard.h); a second one ends the process as usual. One at a
// time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  bool Requested() const;
  // Returns a descriptor that is readable once the signal has come.
  int descriptor() const;
  // Waits until `time` or the signal.
  void WaitUntil(std::chrono::steady_clock::time_point time) const;
};

// Reads a file descriptor; ends when interrupted, even in the midst of waiting for a pipe.
class InterruptibleInput : public std::streambuf {
 public:
  // Does not own the descriptor.
  InterruptibleInput(int descriptor, const Interrupt& interrupt);

 protected:
  int_type underflow() override;

 private:
  int descriptor_;
  const Interrupt& interrupt_;
  std::vector<char> buffer_;
};

}  // namespace polyest::internal
