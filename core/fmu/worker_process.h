#pragma once

// A process that simulates an FMU, as the process that started it sees it. It is killed with this
// object at the latest, and ends itself when the process that started it is gone.

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
  // How long a single call of the FMU may take.
  std::chrono::milliseconds longest_call{60'000};
  int64_t max_memory_bytes = int64_t{4} << 30;     // address space of a worker
  int64_t largest_file_bytes = int64_t{16} << 20;  // that a worker writes
};

// polyest-fmu-worker: what POLYEST_FMU_WORKER names, else beside this program, else in
// ../libexec/polyest from there. FAILED_PRECONDITION if it is nowhere.
absl::StatusOr<std::filesystem::path> FindWorkerProgram();

class WorkerProcess {
 public:
  // `fmu` is the FMU's name, for messages.
  static absl::StatusOr<std::unique_ptr<WorkerProcess>> Start(std::string fmu,
                                                              const WorkerLimits& limits);
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  // Puts a message to be sent; one for which no answer is awaited may precede one for which it is.
  void Send(const std::string& message);
  void AwaitAnswer();
  bool awaits_answer() const { return awaits_answer_; }

  // What to poll for, with the socket.
  int socket() const { return socket_; }
  bool has_to_send() const { return sent_ < outgoing_.size(); }
  // Sends and receives what can be without waiting. FAILED_PRECONDITION when the worker has died or
  // one call takes longer than the limit; then it is dead.
  absl::Status Exchange();
  // The answer, once it is there: awaits_answer() is false.
  std::string TakeAnswer() { return std::move(answer_); }

  // Ends the worker and waits for its end. The second time nothing happens.
  void Kill();
  pid_t pid() const { return pid_; }  // −1 once it is dead

 private:
  WorkerProcess(std::string fmu, const WorkerLimits& limits)
      : fmu_(std::move(fmu)), limits_(limits) {}
  absl::Status MakePage();
  absl::Status Spawn(const std::filesystem::path& program);
  absl::Status SendSome();
  absl::Status ReceiveSome();
  absl::Status CheckProgress();
  // What the worker was doing when it died.
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

// Where a worker finds these, and its limits as arguments.
inline constexpr int kWorkerSocket = 3;
inline constexpr int kWorkerPage = 4;

}  // namespace polyest::internal
