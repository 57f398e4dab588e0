#pragma once

// Reports whether the daemon can be given work, as the service "readiness" of its health service.
// The service "" says that the process lives. The daemon is not ready while the journal's last
// commit failed, nor while it drains.

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

  // `check_writable` tries to write the journal. Start calls it once, and a thread calls it again
  // and again while the last commit has failed, because without it nobody might try any more.
  explicit Readiness(std::function<absl::Status()> check_writable)
      : check_writable_(std::move(check_writable)) {}
  Readiness(const Readiness&) = delete;
  Readiness& operator=(const Readiness&) = delete;

  // Reports to `health` from here on until Drain. `daemon` goes with "ready" into the log.
  void Start(grpc::HealthCheckServiceInterface* health, LogFields daemon = {});
  // Notes whether a commit succeeded. Called after each commit, from the journal's thread.
  void OnCommit(bool kept);
  // Reports that the daemon is not ready, and ends the thread.
  void Drain();

  const std::atomic<bool>& ready() const { return ready_; }

 private:
  void Run(std::stop_token stop);
  // Reports a change; called with the mutex held.
  void Tell();

  const std::function<absl::Status()> check_writable_;
  std::mutex mutex_;
  std::condition_variable_any failed_;
  grpc::HealthCheckServiceInterface* health_ = nullptr;
  LogFields daemon_;
  bool writable_ = false;  // whether the last commit succeeded
  std::atomic<bool> ready_ = false;
  std::jthread thread_;
};

}  // namespace polyest::internal
