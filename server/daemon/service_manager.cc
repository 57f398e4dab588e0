#include "server/daemon/service_manager.h"

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>

#include "core/common/shared_library.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Number of reports within the manager's time-out, so that two in a row may come late before it
// acts.
constexpr int kReportsPerTimeout = 3;
// Time between two checks where no manager asks for reports.
constexpr std::chrono::milliseconds kOwnInterval = std::chrono::seconds(10);

// The functions of libsystemd that are used.
struct Systemd {
  SharedLibrary library;
  decltype(&::sd_notify) notify = nullptr;
  decltype(&::sd_watchdog_enabled) watchdog_enabled = nullptr;
};

absl::StatusOr<Systemd> LoadSystemd() {
  POLYEST_ASSIGN_OR_RETURN(
      SharedLibrary library,
      SharedLibrary::Load("libsystemd.so.0", "cannot report to the service manager: libsystemd"));
  Systemd systemd{.library = std::move(library)};
  POLYEST_RETURN_IF_ERROR(systemd.library.Bind("sd_notify", systemd.notify));
  POLYEST_RETURN_IF_ERROR(systemd.library.Bind("sd_watchdog_enabled", systemd.watchdog_enabled));
  return systemd;
}

// Returns libsystemd, loaded once and only for a manager to report to: it would make other starts
// longer. Null without a manager, and when it cannot be loaded.
const Systemd* SystemdOrNull() {
  if (std::getenv("NOTIFY_SOCKET") == nullptr) return nullptr;
  static const auto* const systemd = [] {
    const auto* const loaded = new absl::StatusOr<Systemd>(LoadSystemd());
    if (!loaded->ok()) spdlog::warn("{}", std::string(loaded->status().message()));
    return loaded;
  }();
  return systemd->ok() ? &**systemd : nullptr;
}

// Returns the time-out that the manager asks for; zero without a watchdog.
std::chrono::microseconds WatchdogTimeout() {
  uint64_t timeout_us = 0;
  const Systemd* const systemd = SystemdOrNull();
  if (systemd == nullptr || systemd->watchdog_enabled(/*unset_environment=*/0, &timeout_us) <= 0) {
    return {};
  }
  return std::chrono::microseconds(timeout_us);
}

void Report(const std::string& state) {
  const Systemd* const systemd = SystemdOrNull();
  if (systemd == nullptr) return;
  const int sent = systemd->notify(/*unset_environment=*/0, state.c_str());
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
