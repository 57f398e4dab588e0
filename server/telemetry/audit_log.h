#pragma once

// Writes down who did what: one JSON object a line, in a file of its own. A line never holds a
// token, a measurement, or a reason that repeats what a client has sent.

#include <absl/status/statusor.h>
#include <google/protobuf/timestamp.pb.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "server/telemetry/structured_log.h"

namespace polyest::internal {

// Thread-safe.
class AuditLog {
 public:
  using WallClock = std::function<google::protobuf::Timestamp()>;

  // Opens the file to append to it, or makes it for its owner only. FAILED_PRECONDITION, naming the
  // file, if that is not possible.
  static absl::StatusOr<std::unique_ptr<AuditLog>> Open(const std::string& file,
                                                        WallClock wall_clock);
  // Writes the lines that wait, as far as the disk takes them, and ends.
  ~AuditLog();
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  // Queues a line: the time, the event and the fields that have a value. Never waits. While the
  // disk takes nothing, kMaxLines lines wait; further ones are lost and counted.
  void Add(const std::string& event, const LogFields& fields);
  // Opens the file again, under its name, before the next line. It also notices by itself when the
  // file was renamed or removed.
  void Reopen() { reopen_ = true; }

  // Largest number of lines that wait.
  static constexpr size_t kMaxLines = 10'000;

 private:
  AuditLog(std::string file, int descriptor, WallClock wall_clock);

  std::string LineOf(const std::string& event, const LogFields& fields) const;
  // The following run on the writing thread.
  void Run(std::stop_token stop);
  bool Write(const std::string& text);
  bool OpenCurrent();
  void Tell(bool written, const std::string& why);

  const std::string file_;
  const WallClock wall_clock_;
  std::atomic<bool> reopen_ = false;
  int descriptor_;
  bool failing_ = false;

  std::mutex mutex_;
  std::condition_variable_any added_;
  std::deque<std::string> lines_;
  int64_t lost_ = 0;
  std::jthread thread_;  // last: stopped and joined before the rest goes
};

}  // namespace polyest::internal
