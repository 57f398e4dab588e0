#pragma once

// Turns a status into the result of a command for scripts: its exit status and one line on the
// standard error.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <ostream>
#include <string>

namespace polyest::internal {

enum ExitStatus : int {
  kExitOk = 0,
  kExitFailure = 1,   // anything else
  kExitBadInput = 2,  // bad usage or input
  kExitServer = 3,    // the server cannot be reached, or it refused
};

// Returns the exit status for an error. What a daemon does not find, or has already, is bad input;
// what its state or its limits do not allow is a refusal. `server` is empty for a local
// computation, for which an exceeded limit is bad input, and a model that cannot be asked for now
// is no fault of a server.
ExitStatus ExitStatusOf(const absl::Status& status, absl::string_view server);

// Prints an error in one line and returns its exit status. `status` must not be OK.
int Report(const absl::Status& status, absl::string_view server, std::ostream& err);

}  // namespace polyest::internal
