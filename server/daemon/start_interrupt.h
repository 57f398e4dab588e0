#pragma once

// Lets a daemon that starts be stopped: converting a large journal, or waiting for a database, may
// take minutes.

#include <signal.h>

#include <thread>

#include "server/net/descriptor.h"

namespace polyest::internal {

// As long as it exists, each of the signals, which must be blocked in all threads, ends the process
// as it would by default. A signal that has not ended it by then stays pending. What the process
// changes meanwhile must bear that it is killed, as transactions do.
class StartInterrupt {
 public:
  explicit StartInterrupt(const sigset_t& signals);
  ~StartInterrupt();
  StartInterrupt(const StartInterrupt&) = delete;
  StartInterrupt& operator=(const StartInterrupt&) = delete;

 private:
  void Wait() const;

  const Descriptor signals_;  // a signalfd
  const Descriptor over_;     // an eventfd
  std::jthread thread_;
};

}  // namespace polyest::internal
