#include "server/daemon/service_manager.h"

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <utility>

namespace polyest::internal {
namespace {

// Number of reports within the manager's time-out, so that two in a row may come late before it
// acts.
constexpr int kReportsPerTimeout = 3;
// Time between two checks where no manager asks for reports.
constexpr std::chrono::milliseconds kOwnInterval = std::chrono::seconds(10);

// Returns the time-out that the manager asks for; zero without a watchdog.
std::chrono::microseconds WatchdogTimeout() {
  uint64_t timeout_us = 0;
  if (sd_watchdog_enabled(/*unset_environment=*/0, &timeout_us) <= 0) return {};
  return std::chrono::microseconds(timeout_us);
}

void Report(const std::string& state) {
  const int sent = sd_notify(/*unset_environment=*/0, state.c_str());
  if (sent < 0) spdlog::warn("cannot report to the service manager: {}", strerror(-sent));
}

}  // namespace

void ReportReady(const std::string& status) { Report("READY=1\nSTATUS=" + status); }

void ReportStopping() { Report("STOPPING=1\nSTATUS=draining"); }

Watchdog::Watchdog(IsAlive is_alive) : is_alive_(std::move(is_alive)) {
  const auto timeout = std::chrono::duration_cast<std::chrono::milliseconds>(WatchdogTimeout());
  const bool reports = timeout.count() > 0;
  const auto interval =
      reports ? std::max(timeout / kReportsPerTimeout, std::chrono::milliseconds(1)) : kOwnInterval;
  thread_ = std::jthread(
      [this, interval, reports](std::stop_token stop) { Run(stop, interval, reports); });
}

void Watchdog::Run(std::stop_token stop, std::chrono::milliseconds interval, bool reports) const {
  std::mutex mutex;
  std::condition_variable_any stopped;
  while (!stop.stop_requested()) {
    if (!is_alive_(interval)) {
      spdlog::warn("the daemon does not answer itself{}",
                   reports ? ": the service manager's watchdog is not fed" : "");
    } else if (reports) {
      Report("WATCHDOG=1");
    }
    std::unique_lock lock(mutex);
    stopped.wait_for(lock, stop, interval, [] { return false; });
  }
}

}  // namespace polyest::internal
