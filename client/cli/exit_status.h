#pragma once

// Turns a status into what a script learns from a command: its exit status and one line on stderr.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <ostream>
#include <string>

namespace polyest::internal {

enum ExitStatus : int {
  kExitOk = 0,
  kExitFailure = 1,   // anything else
  kExitBadInput = 2,  // bad usage or input
  kExitServer = 3,    // server unreachable, or it refused
};

// `server` is empty for what ran locally: then a limit that was passed is bad input.
ExitStatus ExitStatusOf(const absl::Status& status, absl::string_view server);

// Prints the error in one line and returns its exit status. Not for an OK status.
int Report(const absl::Status& status, absl::string_view server, std::ostream& err);

// Puts the name of the file in front of the refusal of a field of the problem or of the
// measurements. Other errors, and those of reading a file, are left alone.
absl::Status InFile(const absl::Status& status, absl::string_view problem_file,
                    absl::string_view data_file);

}  // namespace polyest::internal
