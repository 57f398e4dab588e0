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
  AddDataOptions(command, arguments->data_options);
  AddServer(command, arguments->place)->required();
  command.add_option("--batch", arguments->batch_rows, "Rows per message")
      ->check(WholeBetween(1, 100'000))
      ->capture_default_str();
  command
      .add_option("--rate", arguments->rate,
                  "Speed relative to the data's own time (1: real time; 0: as fast as possible)")
      ->check(Between(0.0, 1e9));
  command.add_option(
      "--session", arguments->session,
      "Name of the session to create, or to resume with rows after its last one. Its run stays "
      "open, so that the last rows of a smooth streamed input wait for further rows.");
  command
      .add_option("--reorder-window", arguments->reorder_window_s,
                  "How much later than rows of other channels a row may come, s in the data's own "
                  "time. Rows are computed once no earlier ones may come; the end of the data ends "
                  "their run. (0: rows come in time order)")
      ->check(Between(0.0, 3600.0));
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
       .summary = "Import a session file into a daemon; the estimate is bit-for-bit the same",
       .examples = {"import rig-1.session --server lab:50051 --session rig-1-copy"}},
      arguments);
  command.add_option("file", arguments->file, "What `polyest export` has written")->required();
  command.add_option("--session", arguments->session,
                     "Name of the session in the daemon (default: its original name)");
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

void AddBackup(CommandRegistry& registry) {
  const auto arguments = std::make_shared<BackupArguments>();
  CLI::App& command = registry.Add(
      {.name = "backup",
       .summary = "Back up all sessions of a daemon into a file, while it works",
       .examples = {"backup --server rig:50051 -o monday.db"},
       .notes =
           "Needs the role operator. Everything that was acknowledged before the command began\n"
           "is in the file, which the daemon has verified; a damaged journal is backed up as it\n"
           "is, and the exit status is 1. `polyestd --check-backup FILE` verifies a backup;\n"
           "the runbook says how to restore it."},
      arguments);
  AddServer(command, arguments->place)->required();
  command.add_option("-o,--output", arguments->output_file, "The file to write")->required();
}

void AddNodes(CommandRegistry& registry) {
  const auto arguments = std::make_shared<NodesArguments>();
  CLI::App& command = registry.Add(
      {.name = "nodes",
       .summary = "List the daemons that share a database, or drain one of them",
       .examples = {"nodes --server rig:50051", "nodes drain 3 --server rig:50051"},
       .notes = "Needs the role admin, and to drain a node the role operator. A node that is\n"
                "drained hands its sessions over to the others, one after the other, and takes\n"
                "no others until it is started again; its clients go on where they are."},
      arguments);
  CLI::Option* const action =
      command.add_option("action", arguments->action, "drain: have a node hand its sessions over")
          ->check(CLI::IsMember({"drain"}));
  CLI::Option* const node = command.add_option(
      "node", arguments->node, "The node to drain: its number, or its address HOST:PORT");
  action->needs(node);
  AddServer(command, arguments->place)->required();
  AddFormat(command, arguments->format, {"table", "json"});
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
       .summary = "Show the state of a daemon and its sessions until q or Ctrl-C",
       .examples = {"top --server rig:50051", "top --server rig:50051 --once"},
       .notes =
           "Columns, for each session: batches acknowledged, estimates and re-expansions since\n"
           "the daemon started, measured values in total and per second, seconds of\n"
           "measurements over seconds computed for them (below 1 it falls behind), whether a\n"
           "stream is open and how many watch, whether it is in memory, the time since its\n"
           "last use. A narrow terminal shows fewer columns."},
      arguments);
  AddServer(command, arguments->place)->required();
  command.add_flag("--once", arguments->once, "Print once and exit");
  command.add_option("--interval", arguments->interval_s, "Refresh interval, s")
      ->check(Between(0.1, 3600.0))
      ->capture_default_str();
  AddBackup(registry);
  AddNodes(registry);
}

}  // namespace polyest::internal
