#pragma once

#include <chrono>
#include <streambuf>
#include <vector>

namespace polyest::internal {

// Turns Ctrl-C into an event that can be waited for. While the object exists, the first SIGINT
// requests an orderly end and restores the mode of the terminal (keyboard.h); a second one ends the
// process as usual. Where the process is to ignore SIGINT, as in the background of a shell script,
// it does. Only one object may exist at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  // Returns whether SIGINT has been received.
  bool Requested() const;
  // Returns a descriptor that becomes readable when SIGINT is received.
  int descriptor() const;
  // Waits until `time` or until SIGINT is received.
  void WaitUntil(std::chrono::steady_clock::time_point time) const;

 private:
  bool ignored_ = false;
};

// Reads a file descriptor. An interrupt ends the input, also while it waits for a pipe.
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
