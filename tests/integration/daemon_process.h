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
  // Starts it with these arguments, and with a data folder of its own unless they name one; nothing
  // is waited for.
  explicit DaemonProcess(std::vector<std::string> arguments);
  // Kills it if it still runs.
  ~DaemonProcess();
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  // The next line of its stdout, without the end of line; empty at the end.
  std::string ReadLine();
  // HOST:PORT out of its first line.
  std::string ReadAddress();
  void Signal(int number);
  pid_t pid() const { return pid_; }
  // Its exit status, or −(signal) that ended it.
  int Wait();
  // Everything it wrote to stderr so far.
  std::string Errors();

 private:
  TestFolder data_;
  pid_t pid_ = -1;
  FILE* output_ = nullptr;
  FILE* errors_ = nullptr;
};

}  // namespace polyest::internal
