#pragma once

// polyestd as a child process.

#include <sys/types.h>

#include <cstdio>
#include <string>
#include <vector>

#include "tests/testing/test_folder.h"

namespace polyest::internal {

class DaemonProcess {
 public:
  // Starts the daemon with these arguments, and with its own data folder unless they name one.
  // Waits for nothing.
  explicit DaemonProcess(std::vector<std::string> arguments);
  // Kills the daemon if it still runs.
  ~DaemonProcess();
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  // Returns the next line of stdout without its end; empty at the end of the output.
  std::string ReadLine();
  // Returns HOST:PORT from the first line.
  std::string ReadAddress();
  void Signal(int number);
  pid_t pid() const { return pid_; }
  // Returns the exit status, or −(signal) if a signal ended the daemon.
  int Wait();
  // Returns the processor time that the daemon has used until Wait returned, in seconds.
  double computed_s() const { return computed_s_; }
  // Returns everything that the daemon has written to stderr so far.
  std::string Errors() const;

 private:
  TestFolder data_;
  pid_t pid_ = -1;
  double computed_s_ = 0;
  FILE* output_ = nullptr;
  FILE* errors_ = nullptr;
};

}  // namespace polyest::internal
