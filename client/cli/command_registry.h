#pragma once

// Collects the commands and their options, which several files define.

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/arguments.h"

namespace polyest::internal {

struct CommandText {
  const char* name;
  const char* summary;
  std::vector<const char*> examples;  // without "polyest"
  const char* notes = "";             // below the options
};

class CommandRegistry {
 public:
  // `threads` is the default of --threads.
  CommandRegistry(CLI::App& app, int threads) : app_(app), threads_(threads) {}

  // Starts the heading under which `polyest --help` lists the commands added next.
  void StartGroup(const std::string& title) { group_ = title; }

  // Adds a command whose options are parsed into `arguments`.
  template <typename Arguments>
  CLI::App& Add(const CommandText& text, const std::shared_ptr<Arguments>& arguments) {
    if constexpr (requires { arguments->place; }) arguments->place.threads = threads_;
    CLI::App& command = AddCommand(text);
    results_[&command] = [arguments] { return Command(*arguments); };
    return command;
  }

  int threads() const { return threads_; }

  // Returns the parsed command line.
  CommandLine Result() const { return {results_.at(app_.get_subcommands().front())(), color_}; }

 private:
  CLI::App& AddCommand(const CommandText& text);

  CLI::App& app_;
  const int threads_;
  std::string group_;
  ColorChoice color_ = ColorChoice::kAuto;
  std::map<const CLI::App*, std::function<Command()>> results_;
};

// Each of the following functions adds the commands of one group.
void AddEstimationCommands(CommandRegistry& registry);
void AddPlanningCommands(CommandRegistry& registry);
void AddSessionCommands(CommandRegistry& registry);
void AddDaemonCommands(CommandRegistry& registry);
void AddOtherCommands(CommandRegistry& registry);

}  // namespace polyest::internal
