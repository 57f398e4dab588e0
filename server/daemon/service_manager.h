#pragma once

// Reports to the service manager that started the daemon, systemd with Type=notify. Without one
// (no $NOTIFY_SOCKET), reports go nowhere.

#include <chrono>
#include <functional>
#include <string>
#include <thread>

namespace polyest::internal {

// Reports that the daemon serves. `status` is one line that `systemctl status` shows.
void ReportReady(const std::string& status);

// Reports that the daemon is shutting down in order. The manager waits TimeoutStopSec from here on,
// and its watchdog sleeps.
void ReportStopping();

// Feeds the manager's watchdog as long as the daemon is alive; the manager kills a daemon that is
// not, and starts it again, after WatchdogSec. Runs a thread of its own, and none when no watchdog
// is asked for.
class Watchdog {
 public:
  // Returns whether the daemon works; answers within the given time.
  using IsAlive = std::function<bool(std::chrono::milliseconds)>;

  explicit Watchdog(IsAlive is_alive);
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  // Waits for a check that is under way.
  ~Watchdog() = default;

 private:
  void Run(std::stop_token stop, std::chrono::milliseconds interval) const;

  const IsAlive is_alive_;
  std::jthread thread_;
};

}  // namespace polyest::internal
