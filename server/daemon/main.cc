// Runs polyestd, the daemon as a process.

#include <malloc.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <thread>

#include "server/daemon/command_line.h"
#include "server/daemon/daemon.h"
#include "server/daemon/service_manager.h"
#include "server/daemon/start_interrupt.h"
#include "server/telemetry/library_log.h"
#include "server/telemetry/structured_log.h"

namespace {

void StartLog(const polyest::internal::CommandLine& command_line) {
  polyest::internal::StartLog(command_line.log_format == "json"
                                  ? polyest::internal::LogFormat::kJson
                                  : polyest::internal::LogFormat::kText,
                              spdlog::level::from_str(command_line.log_level));
  polyest::internal::StartLibraryLog();
}

// Keeps the heap from growing for days. Memory that was freed is used again only within its arena,
// of which glibc makes eight a core, each as large as its busiest moment; and glibc returns a large
// block to the operating system at once only until it has freed one of that size. Must be called
// before there are threads.
void BoundHeap() {
  constexpr int kLargeBlock = 1 << 20;
  const auto cores = static_cast<int>(std::thread::hardware_concurrency());
  mallopt(M_ARENA_MAX, std::max(4, 2 * cores));
  mallopt(M_MMAP_THRESHOLD, kLargeBlock);
  mallopt(M_TRIM_THRESHOLD, kLargeBlock);
}

// Blocks the signals that only sigwait takes, and ignores those after which a write fails with an
// error: to a connection that is closed, and to a file that may not grow (ulimit -f). Called before
// there are threads, so that the signals are blocked in all of them.
sigset_t BlockSignals() {
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

// Starts the daemon. SIGTERM and SIGINT end the process at once meanwhile: nobody is served yet,
// and what is on disk stays whole. SIGHUP waits.
absl::StatusOr<std::unique_ptr<polyest::internal::Daemon>> Start(
    const polyest::internal::DaemonOptions& options) {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGTERM);
  sigaddset(&ends, SIGINT);
  const polyest::internal::StartInterrupt interrupt(ends);
  return polyest::internal::Daemon::Start(options);
}

// Prints on stdout, a line each, where the daemon listens, and tells the service manager that it
// serves.
void Announce(const polyest::internal::Daemon& daemon) {
  std::string addresses;
  for (const polyest::internal::ListenAddress& address : daemon.addresses()) {
    std::printf("listening on %s\n", address.ToString().c_str());
    addresses += (addresses.empty() ? "" : ", ") + address.ToString();
  }
  if (const auto& metrics = daemon.metrics_address()) {
    std::printf("metrics on %s\n", metrics->ToString().c_str());
  }
  if (const auto& web = daemon.web_address()) {
    std::printf("web page on %s://%s/\n", daemon.encrypts() ? "https" : "http",
                web->ToString().c_str());
  }
  if (const auto& umbridge = daemon.umbridge_address()) {
    std::printf("UM-Bridge models on %s://%s/\n", daemon.encrypts() ? "https" : "http",
                umbridge->ToString().c_str());
  }
  std::fflush(stdout);
  polyest::internal::ReportReady("listening on " + addresses);
}

}  // namespace

int main(int argc, char** argv) {
  BoundHeap();
  const polyest::internal::CommandLine command_line =
      polyest::internal::ParseCommandLine(argc, argv);
  if (command_line.done) return command_line.exit_status;
  const sigset_t signals = BlockSignals();
  // gRPC's traces show the headers of calls, and so the tokens.
  if (!command_line.daemon.token_file.empty()) unsetenv("GRPC_TRACE");
  StartLog(command_line);

  auto daemon = Start(command_line.daemon);
  if (!daemon.ok()) {
    std::fprintf(stderr, "polyestd: %s\n", std::string(daemon.status().message()).c_str());
    return 1;
  }
  Announce(**daemon);
  std::optional<polyest::internal::Watchdog> watchdog(
      std::in_place, [&daemon](auto timeout) { return (*daemon)->IsAlive(timeout); });

  int signal_number = 0;
  while (sigwait(&signals, &signal_number) == 0 && signal_number == SIGHUP) (*daemon)->Reload();
  spdlog::info("{}: draining", strsignal(signal_number));
  polyest::internal::ReportStopping();
  watchdog.reset();
  if (!(*daemon)->Stop()) {
    spdlog::warn("stopped without computations that went on after they were cancelled");
    spdlog::default_logger()->flush();
    std::_Exit(0);
  }
  spdlog::info("stopped");
  return 0;
}
