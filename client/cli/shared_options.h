#pragma once

// The options that several commands share.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client/cli/arguments.h"

namespace polyest::internal {

// Adds --server, --deadline, and how to get in. Returns --server.
CLI::Option* AddServer(CLI::App& command, Place& place);
CLI::Option* AddFmuFolder(CLI::App& command, Place& place);
void AddThreads(CLI::App& command, int& threads);
// Adds the choice of a daemon or this process. Returns --server.
CLI::Option* AddPlace(CLI::App& command, Place& place);
// Add the files as arguments that must be given.
void AddProblem(CLI::App& command, std::string& file);
void AddData(CLI::App& command, std::string& file);
// Adds a problem and data, or --session in their place, for a study of an estimate.
void AddStudyInput(CLI::App& command, Place& place, std::string& problem_file,
                   std::string& data_file, std::string& session);
template <typename Arguments>
void AddStudyInput(CLI::App& command, Arguments& arguments) {
  AddStudyInput(command, arguments.place, arguments.problem_file, arguments.data_file,
                arguments.session);
}
void AddOutputs(CLI::App& command, std::vector<std::string>& outputs, const char* help);
// Adds --format with these names, the first by default.
void AddFormat(CLI::App& command, Format& format, const std::vector<std::string>& names);

}  // namespace polyest::internal
