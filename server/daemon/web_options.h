#pragma once

// The options of the HTTP ports.

#include <absl/status/status.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "server/daemon/daemon.h"

namespace polyest::internal {

// The options as they are given.
struct WebTexts {
  std::string address;   // of --web; empty: no such port
  std::string umbridge;  // likewise
  std::vector<std::string> hosts;
};

void AddWebOptions(CLI::App& app, WebTexts& texts);

// Sets what follows from the texts, when encryption and authentication are known. INVALID_ARGUMENT
// or FAILED_PRECONDITION, naming the option: an address is refused that is more exposed than is
// allowed.
absl::Status ApplyWebOptions(const WebTexts& texts, bool insecure, DaemonOptions& daemon);

}  // namespace polyest::internal
