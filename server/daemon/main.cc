// polyestd: the daemon as a process.

#include <grpc/support/log.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <cstdlib>

#include "server/daemon/command_line.h"
#include "server/daemon/daemon.h"
#include "server/telemetry/structured_log.h"

namespace {

// gRPC's own messages are for debugging; what matters of them comes back as a status.
void LogOfGrpc(gpr_log_func_args* arguments) { spdlog::debug("grpc: {}", arguments->message); }

void StartLog(const polyest::CommandLine& command_line) {
  polyest::StartLog(
      command_line.log_format == "json" ? polyest::LogFormat::kJson : polyest::LogFormat::kText,
      spdlog::level::from_str(command_line.log_level));
  gpr_set_log_function(LogOfGrpc);
}

// Blocked here, before there are threads, and so in all of them: only sigwait takes these signals.
sigset_t BlockSignals() {
  signal(SIGPIPE, SIG_IGN);
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

}  // namespace

int main(int argc, char** argv) {
  const polyest::CommandLine command_line = polyest::ParseCommandLine(argc, argv);
  if (command_line.done) return command_line.exit_status;
  const sigset_t signals = BlockSignals();
  // gRPC's traces show the headers of calls, and so the tokens.
  if (!command_line.daemon.token_file.empty()) unsetenv("GRPC_TRACE");
  StartLog(command_line);

  auto daemon = polyest::Daemon::Start(command_line.daemon);
  if (!daemon.ok()) {
    std::fprintf(stderr, "polyestd: %s\n", std::string(daemon.status().message()).c_str());
    return 1;
  }
  std::printf("listening on %s\n", (*daemon)->address().ToString().c_str());
  if (const auto& metrics = (*daemon)->metrics_address()) {
    std::printf("metrics on %s\n", metrics->ToString().c_str());
  }
  std::fflush(stdout);

  int signal_number = 0;
  while (sigwait(&signals, &signal_number) == 0 && signal_number == SIGHUP) (*daemon)->Reload();
  spdlog::info("{}: draining", strsignal(signal_number));
  (*daemon)->Stop();
  spdlog::info("stopped");
  return 0;
}
