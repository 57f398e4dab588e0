#pragma once

#include <string>

#include "server/daemon/daemon.h"

namespace polyest::internal {

struct CommandLine {
  DaemonOptions daemon;
  std::string log_level = "info";
  std::string log_format = "text";
  // When set, there is nothing to run: help or the version is printed, or the usage was wrong.
  bool done = false;
  int exit_status = 0;
};

CommandLine ParseCommandLine(int argc, char** argv);

}  // namespace polyest::internal
