#pragma once

// The options that several commands share.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client/cli/arguments.h"

namespace polyest {

// --server, --deadline, and how to get in.
CLI::Option* AddServer(CLI::App& command, Place& place);
CLI::Option* AddFmuFolder(CLI::App& command, Place& place);
// A daemon or this process.
void AddPlace(CLI::App& command, Place& place);
void AddProblem(CLI::App& command, std::string& file);
void AddOutputs(CLI::App& command, std::vector<std::string>& outputs, const char* help);
// One of these names, the first by default.
void AddFormat(CLI::App& command, Format& format, const std::vector<std::string>& names);

}  // namespace polyest
