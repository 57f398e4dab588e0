#pragma once

// Takes the value of an option from the first of these that has one: its flag, its environment
// variable, the configuration file, its default.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace polyest::internal {

// Returns the variable of an option: POLYESTD_DATA_DIR for --data-dir.
std::string EnvironmentVariable(const std::string& option);

// Gives each option its variable, and adds --config, whose own variable is POLYESTD_CONFIG. Must be
// called when the app has all its options. A line of a file names an option without its dashes,
// such as `data-dir = "/srv/polyest"`. Options named in `flags_only` are flags and nothing else.
void AddConfiguration(CLI::App& app, const std::vector<std::string>& flags_only);

// Returns what is wrong with the environment, in one line; empty: nothing. Every variable
// POLYESTD_… must be that of an option, since a misspelled one would otherwise be ignored silently.
// Exceptions are the variables that Kubernetes sets in all containers beside a service named
// polyestd.
std::string CheckEnvironment(const CLI::App& app, const char* const* environment);

// Returns what was wrong, in one line that names the flag, the variable, or the file and its key.
std::string DescribeError(const CLI::App& app, const CLI::ParseError& error, int argc,
                          const char* const* argv);

}  // namespace polyest::internal
