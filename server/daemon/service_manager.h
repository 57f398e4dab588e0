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

// Checks again and again whether the daemon is alive, from a thread of its own: three times in
// WatchdogSec, or every 10 s when the manager asks for no watchdog. Feeds the manager's watchdog as
// long as the daemon is; the manager kills a daemon that is not, and starts it again, after
// WatchdogSec.
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
  void Run(std::stop_token stop, std::chrono::milliseconds interval, bool reports) const;

  const IsAlive is_alive_;
  std::jthread thread_;
};

}  // namespace polyest::internal
