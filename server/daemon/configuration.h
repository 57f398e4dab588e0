#pragma once

// Where the value of an option comes from, the first that has one: its flag, its environment
// variable, the configuration file, its default.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace polyest {

// The variable of an option: POLYESTD_DATA_DIR of --data-dir.
std::string EnvironmentVariable(const std::string& option);

// To be called when the app has all its options: gives each its variable, and adds --config, itself
// $POLYESTD_CONFIG. In a file, options stand without their dashes: `data-dir = "/srv/polyest"`.
// Those named in `flags_only` are flags and nothing else.
void AddConfiguration(CLI::App& app, const std::vector<std::string>& flags_only);

// What was wrong, in one line that names the flag, the variable, or the file and its key.
std::string DescribeError(const CLI::App& app, const CLI::ParseError& error, int argc,
                          const char* const* argv);

}  // namespace polyest
