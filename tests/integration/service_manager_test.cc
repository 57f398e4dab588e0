// Tests the daemon's reports to the service manager, which is a socket of the test's own.

#include "server/daemon/service_manager.h"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/un.h>

#include <atomic>

#include "tests/integration/operations_fixture.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::StartsWith;

// The time limit of a report, far longer than one takes on any machine.
constexpr timeval kPatience{60, 0};

// A service manager: owns the socket that $NOTIFY_SOCKET names.
class ServiceManager {
 public:
  ServiceManager() : socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof(address.sun_path) - 1);
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof(kPatience)), 0);
  }
  ~ServiceManager() { close(socket_); }
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  // Returns the next report; empty if none comes.
  std::string Read() const {
    char buffer[1024];
    const ssize_t size = recv(socket_, buffer, sizeof(buffer), 0);
    return {buffer, static_cast<size_t>(std::max<ssize_t>(size, 0))};
  }

 private:
  const TestFolder folder_;
  const std::string path_ = folder_ / "notify";
  const Variable variable_{"NOTIFY_SOCKET", path_};
  const int socket_;
};

TEST(ServiceManager, IsToldThatTheDaemonIsReadyAndThatItStops) {
  const ServiceManager manager;
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--listen", "127.0.0.1:0"});
  const std::string first = daemon.ReadAddress();
  const std::string second = daemon.ReadAddress();
  EXPECT_EQ(manager.Read(), "READY=1\nSTATUS=listening on " + first + ", " + second);
  daemon.Signal(SIGTERM);
  EXPECT_THAT(manager.Read(), StartsWith("STOPPING=1\n"));
  EXPECT_EQ(daemon.Wait(), 0) << daemon.Errors();
}

TEST(ServiceManager, HasItsWatchdogFedByADaemonThatAnswers) {
  const ServiceManager manager;
  const Variable timeout("WATCHDOG_USEC", "30000");
  DaemonProcess daemon({"--listen", "127.0.0.1:0"});
  EXPECT_THAT(manager.Read(), StartsWith("READY=1\n"));
  EXPECT_EQ(manager.Read(), "WATCHDOG=1");
  EXPECT_EQ(manager.Read(), "WATCHDOG=1");
}

TEST(ServiceManager, HasItsWatchdogNotFedByADaemonThatDoesNotAnswer) {
  constexpr int kSilent = 3;
  const ServiceManager manager;
  const Variable timeout("WATCHDOG_USEC", "30000");
  std::atomic<int> checks = 0;
  const Watchdog watchdog([&](std::chrono::milliseconds) { return ++checks > kSilent; });
  EXPECT_EQ(manager.Read(), "WATCHDOG=1");
  EXPECT_GT(checks, kSilent);
}

}  // namespace
}  // namespace polyest::internal
