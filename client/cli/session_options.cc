// Adds the commands for a daemon and its sessions.

#include <memory>

#include "client/cli/command_registry.h"
#include "client/cli/shared_options.h"

namespace polyest::internal {
namespace {

void AddSession(CLI::App& command, std::string& session) {
  command.add_option("session", session, "The session's name")->required();
}

void AddStream(CommandRegistry& registry) {
  const auto arguments = std::make_shared<StreamArguments>();
  CLI::App& command = registry.Add(
      {.name = "stream",
       .summary = "Stream data to a daemon, printing each estimate",
       .examples = {"stream problem.json data.csv --server rig:50051 --rate 1",
                    "stream problem.json - --server rig:50051 --session rig-1 < pipe"}},
      arguments);
  AddProblem(command, arguments->problem_file);
  command.add_option("data", arguments->data_file, "The measurements, a CSV file, or -")
      ->required();
  AddServer(command, arguments->place)->required();
  command.add_option("--batch", arguments->batch_rows, "Rows a message")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  command
      .add_option("--rate", arguments->rate,
                  "Send this many times as fast as the data's time; 0: at once")
      ->check(CLI::Range(0.0, 1e9));
  command.add_option(
      "--session", arguments->session,
      "The session to create, or to resume: then with rows after its last, in the same run "
      "too, so that the last few rows of a smooth streamed input wait for them");
  AddFormat(command, arguments->format, {"table", "jsonl"});
}

void AddWatch(CommandRegistry& registry) {
  const auto arguments = std::make_shared<WatchArguments>();
  CLI::App& command = registry.Add(
      {.name = "watch",
       .summary = "Print the estimates of a session as they come, until Ctrl-C",
       .examples = {"watch rig-1 --server rig:50051",
                    "watch rig-1 --server rig:50051 --once --format jsonl"},
       .notes = "The present estimate is the first. A slow reader misses some in between, never\n"
                "the last."},
      arguments);
  AddSession(command, arguments->session);
  AddServer(command, arguments->place)->required();
  command.add_flag("--once", arguments->once, "Print the present estimate and end");
  AddFormat(command, arguments->format, {"table", "jsonl"});
}

void AddList(CommandRegistry& registry) {
  const auto arguments = std::make_shared<ListArguments>();
  CLI::App& command = registry.Add({.name = "list",
                                    .summary = "List the sessions of a daemon",
                                    .examples = {"list --server rig:50051"}},
                                   arguments);
  AddServer(command, arguments->place)->required();
  AddFormat(command, arguments->format, {"table", "json"});
}

void AddExport(CommandRegistry& registry) {
  const auto arguments = std::make_shared<ExportArguments>();
  CLI::App& command = registry.Add({.name = "export",
                                    .summary = "Write a session of a daemon into a file",
                                    .examples = {"export rig-1 rig-1.session --server rig:50051"}},
                                   arguments);
  AddSession(command, arguments->session);
  command.add_option("file", arguments->file, "The file to write")->required();
  AddServer(command, arguments->place)->required();
}

void AddImport(CommandRegistry& registry) {
  const auto arguments = std::make_shared<ImportArguments>();
  CLI::App& command = registry.Add(
      {.name = "import",
       .summary = "Make a session of a daemon out of a file: the same estimate to the last bit",
       .examples = {"import rig-1.session --server lab:50051 --session rig-1-copy"}},
      arguments);
  command.add_option("file", arguments->file, "What `polyest export` has written")->required();
  command.add_option("--session", arguments->session, "Its name there (default the one it had)");
  AddServer(command, arguments->place)->required();
}

void AddDelete(CommandRegistry& registry) {
  const auto arguments = std::make_shared<DeleteArguments>();
  CLI::App& command =
      registry.Add({.name = "delete",
                    .summary = "Delete a session of a daemon, with all that was measured for it",
                    .examples = {"delete rig-1 --server rig:50051"}},
                   arguments);
  AddSession(command, arguments->session);
  AddServer(command, arguments->place)->required();
}

}  // namespace

void AddSessionCommands(CommandRegistry& registry) {
  registry.StartGroup("Sessions");
  AddStream(registry);
  AddWatch(registry);
  AddList(registry);
  AddExport(registry);
  AddImport(registry);
  AddDelete(registry);
}

void AddDaemonCommands(CommandRegistry& registry) {
  registry.StartGroup("Daemon");
  const auto arguments = std::make_shared<TopArguments>();
  CLI::App& command = registry.Add(
      {.name = "top",
       .summary = "Show how a daemon and its sessions are, until q or Ctrl-C",
       .examples = {"top --server rig:50051", "top --server rig:50051 --once"},
       .notes =
           "For each session: the batches acknowledged, estimates made and re-expansions since\n"
           "the daemon was started, values of measured outputs in all and a second, seconds\n"
           "of measurements over seconds computed for them (below 1 it falls behind),\n"
           "whether a stream is open and how many watch, whether it is in memory, the time\n"
           "since its last use. A narrow terminal shows fewer columns."},
      arguments);
  AddServer(command, arguments->place)->required();
  command.add_flag("--once", arguments->once, "Once, and end");
  command.add_option("--interval", arguments->interval_s, "From one look to the next, s")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
}

}  // namespace polyest::internal
