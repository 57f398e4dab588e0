#pragma once

// Notices when files change.

#include <sys/stat.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

namespace polyest::internal {

// Compares files by time, size and inode, so that files replaced by others of the same time are
// noticed, too.
class FileChanges {
 public:
  explicit FileChanges(std::vector<std::string> files);

  // Returns whether any file has changed since the last time that this returned true, and none
  // since the last call. A change is thus reported when it has settled, so that one file is not
  // read before another that belongs to it has come.
  bool Poll();

 private:
  struct Stamp {
    dev_t device = 0;
    ino_t inode = 0;
    off_t size = -1;  // no file
    time_t changed_s = 0;
    long changed_ns = 0;
    bool operator==(const Stamp&) const = default;
  };

  std::vector<Stamp> Look() const;

  std::vector<std::string> files_;
  std::vector<Stamp> told_;
  std::vector<Stamp> seen_;
};

// Polls files from a thread of its own.
class FileWatch {
 public:
  // Calls `changed` from that thread until the watch is destroyed. `changes` must be made before
  // the files are read for the first time, so that no change is missed.
  FileWatch(FileChanges changes, std::chrono::milliseconds interval, std::function<void()> changed);

 private:
  void Run(const std::stop_token& stop, std::chrono::milliseconds interval);

  FileChanges changes_;
  const std::function<void()> changed_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;  // last: stopped and joined before the rest goes
};

}  // namespace polyest::internal
