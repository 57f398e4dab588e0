#pragma once

// Whether the daemon can be given work: "readiness" in its health service, apart from "", which
// says that the process lives. It is not while the journal's last commit failed, nor while it
// drains.

#include <absl/status/status.h>
#include <grpcpp/health_check_service_interface.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "server/telemetry/structured_log.h"

namespace polyest::internal {

class Readiness {
 public:
  static constexpr char kService[] = "readiness";

  // `check_writable` is called from a thread of its own: at once, and now and again while the last
  // commit has failed, for without it nobody may try any more.
  explicit Readiness(std::function<absl::Status()> check_writable)
      : check_writable_(std::move(check_writable)) {}
  Readiness(const Readiness&) = delete;
  Readiness& operator=(const Readiness&) = delete;

  // Tells `health` from here on until Drain. `daemon` goes with "ready" into the log.
  void Start(grpc::HealthCheckServiceInterface* health, LogFields daemon = {});
  // After each commit, from the journal's thread.
  void OnCommit(bool kept);
  void Drain();

  const std::atomic<bool>& ready() const { return ready_; }

 private:
  void Run(std::stop_token stop);
  // With the mutex held.
  void Tell();

  const std::function<absl::Status()> check_writable_;
  std::mutex mutex_;
  std::condition_variable_any failed_;
  grpc::HealthCheckServiceInterface* health_ = nullptr;
  LogFields daemon_;
  bool writable_ = false;  // as the last commit was
  std::atomic<bool> ready_ = false;
  std::jthread thread_;
};

}  // namespace polyest::internal
