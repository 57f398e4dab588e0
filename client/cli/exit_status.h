#pragma once

// What a script learns from a command: its exit status, and one line on stderr.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <ostream>
#include <string>

namespace polyest {

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

// The estimator's messages start with a field of the problem or of the measurements: puts the name
// of the file in front. Other errors, and those of reading the data file, are left alone.
absl::Status InFile(const absl::Status& status, absl::string_view problem_file,
                    absl::string_view data_file);

}  // namespace polyest
