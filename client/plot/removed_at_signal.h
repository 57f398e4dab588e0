#pragma once

#include <string>

namespace polyest::internal {

// While the object exists, a signal that ends the process (SIGHUP, SIGINT or SIGTERM) first removes
// a file. Signals that the process ignores or handles otherwise are left alone. Of several objects
// at a time only the first removes its file.
class RemovedAtSignal {
 public:
  explicit RemovedAtSignal(std::string file);
  ~RemovedAtSignal();
  RemovedAtSignal(const RemovedAtSignal&) = delete;
  RemovedAtSignal& operator=(const RemovedAtSignal&) = delete;

 private:
  const std::string file_;
  bool first_ = false;
};

}  // namespace polyest::internal
