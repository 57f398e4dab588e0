#pragma once

// A worker process that simulates an FMU, seen from the process that started it. It is killed with
// this object at the latest. It also ends itself when the process that started it is gone.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/fmu/status_page.h"

namespace polyest::internal {

struct WorkerLimits {
  // Maximum duration of a single call of the FMU.
  std::chrono::milliseconds longest_call{60'000};
  int64_t max_memory_bytes = int64_t{4} << 30;     // address space of a worker
  int64_t largest_file_bytes = int64_t{16} << 20;  // maximum size of a file that a worker writes
};

// Returns the path of polyest-fmu-worker: the value of POLYEST_FMU_WORKER if it is set, else the
// program beside this one, else the one in ../libexec/polyest relative to it. Returns Unavailable
// if there is none.
absl::StatusOr<std::filesystem::path> FindWorkerProgram();

class WorkerProcess {
 public:
  // Starts a worker. `fmu` is the FMU's name, for messages. Returns Unavailable if the
  // worker program is missing or the process cannot be started.
  static absl::StatusOr<std::unique_ptr<WorkerProcess>> Start(std::string fmu,
                                                              const WorkerLimits& limits);
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  // Queues a message. Several messages may be queued before AwaitAnswer.
  void Send(const std::string& message);
  // Declares that the last queued message has an answer, which Exchange then receives. No other
  // answer may be awaited.
  void AwaitAnswer();
  bool awaits_answer() const { return awaits_answer_; }

  // The socket and the direction to poll for.
  int socket() const { return socket_; }
  bool has_to_send() const { return sent_ < outgoing_.size(); }
  // Sends and receives as much as possible without waiting. Returns FailedPrecondition when the
  // worker has died, or when one call takes longer than the limit; the worker is then killed.
  // Returns Unavailable when something else has stopped the worker.
  absl::Status Exchange();
  // Returns the answer. It is available once awaits_answer() is false.
  std::string TakeAnswer() { return std::move(answer_); }

  // Kills the worker and waits for its end. Has no effect if it is already dead.
  void Kill();
  pid_t pid() const { return pid_; }  // −1 once dead

 private:
  WorkerProcess(std::string fmu, const WorkerLimits& limits)
      : fmu_(std::move(fmu)), limits_(limits) {}
  absl::Status MakePage();
  absl::Status Spawn(const std::filesystem::path& program);
  absl::Status SendSome();
  absl::Status ReceiveSome();
  absl::Status CheckProgress();
  // Reaps the dead worker, or stops one that has only closed its socket, and returns an error that
  // describes its last activity.
  absl::Status Died();
  std::string WhatItDid() const;

  std::string fmu_;
  WorkerLimits limits_;
  pid_t pid_ = -1;
  int socket_ = -1;
  int page_descriptor_ = -1;
  StatusPage* page_ = nullptr;
  std::string outgoing_;
  size_t sent_ = 0;
  std::string incoming_;
  std::string answer_;
  bool awaits_answer_ = false;
  uint64_t calls_seen_ = 0;
  std::chrono::steady_clock::time_point progress_seen_;
};

// File descriptors of the socket and the status page in a worker. Its limits are passed as
// arguments.
inline constexpr int kWorkerSocket = 3;
inline constexpr int kWorkerPage = 4;

}  // namespace polyest::internal
