#pragma once

#include <string>

#include "server/daemon/daemon.h"

namespace polyest::internal {

struct CommandLine {
  DaemonOptions daemon;
  std::string log_level = "info";
  std::string log_format = "text";
  // Whether there is nothing to run: help, the version or a new token has been printed, or the
  // usage was wrong.
  bool done = false;
  int exit_status = 0;
};

// Parses the command line, the environment and the file of --config. Prints what is wrong with them
// to stderr.
CommandLine ParseCommandLine(int argc, char** argv);

}  // namespace polyest::internal
