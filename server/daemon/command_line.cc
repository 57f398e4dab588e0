#include "server/daemon/command_line.h"

#include <CLI/CLI.hpp>
#include <iostream>

namespace polyest {
namespace {

constexpr int kBadUsage = 2;

CommandLine Done(int exit_status) {
  CommandLine command_line;
  command_line.done = true;
  command_line.exit_status = exit_status;
  return command_line;
}

CommandLine Refuse(const std::string& message) {
  std::cerr << "polyestd: " << message << std::endl;
  return Done(kBadUsage);
}

}  // namespace

CommandLine ParseCommandLine(int argc, char** argv) {
  CLI::App app("Estimates uncertain parameters of mechanical models from streamed measurements.",
               "polyestd");
  CommandLine command_line;
  DaemonOptions& daemon = command_line.daemon;
  std::string listen = daemon.listen.ToString();
  std::string data_dir;
  app.add_option("--listen", listen, "HOST:PORT to listen on; port 0 picks a free one")
      ->capture_default_str();
  app.add_option("--data-dir", data_dir,
                 "Accepted and not used yet: sessions live in memory and end with the daemon");
  app.add_option("--fmu-dir", daemon.fmu_dir,
                 "Folder of the FMUs that problems may name; put in it only what you would run");
  app.add_option("--threads", daemon.threads, "Threads of the numerics; 0: one a core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--max-sessions", daemon.most_sessions, "Sessions at a time")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--max-message-mb", daemon.most_message_mb, "Largest message taken, MiB")
      ->check(CLI::Range(1, 2047))
      ->capture_default_str();
  app.add_option("--log-level", command_line.log_level, "How much is logged, on stderr")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error", "off"}))
      ->capture_default_str();
  app.set_version_flag("--version", "polyestd " POLYEST_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return Done(app.exit(success));
  } catch (const CLI::ParseError& error) {
    return Refuse(error.what());
  }
  auto address = ListenAddress::Parse(listen);
  if (!address.ok()) return Refuse(std::string(address.status().message()));
  daemon.listen = *std::move(address);
  return command_line;
}

}  // namespace polyest
