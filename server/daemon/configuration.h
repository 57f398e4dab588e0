#pragma once

// Where the value of an option comes from, the first that has one: its flag, its environment
// variable, the configuration file, its default.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace polyest::internal {

// The variable of an option: POLYESTD_DATA_DIR of --data-dir.
std::string EnvironmentVariable(const std::string& option);

// To be called when the app has all its options: gives each its variable, and adds --config, itself
// $POLYESTD_CONFIG. In a file, options stand without their dashes: `data-dir = "/srv/polyest"`.
// Those named in `flags_only` are flags and nothing else.
void AddConfiguration(CLI::App& app, const std::vector<std::string>& flags_only);

// What is wrong with the environment, in one line; empty: nothing. Every variable POLYESTD_… must
// be that of an option, since a misspelled one would otherwise be left out without a word. Excepted
// are those that Kubernetes sets in all containers beside a service of the name polyestd.
std::string CheckEnvironment(const CLI::App& app, const char* const* environment);

// What was wrong, in one line that names the flag, the variable, or the file and its key.
std::string DescribeError(const CLI::App& app, const CLI::ParseError& error, int argc,
                          const char* const* argv);

}  // namespace polyest::internal
