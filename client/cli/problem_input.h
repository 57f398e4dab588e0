#pragma once

// Reads the input of the commands: a problem and data from files, or a session of a daemon. A
// problem is checked before any data are read or sent, so that its errors are not reported as
// errors of the data.

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <string>

#include "client/cli/arguments.h"
#include "client/cli/data_input.h"
#include "client/cli/data_warnings.h"
#include "client/cli/input_files.h"
#include "core/common/status.h"
#include "polyest/v1/problem.pb.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Reads a problem and checks it. An error of the file or of the problem is INVALID_ARGUMENT, and
// its message begins with the file's name. A problem with an FMU or a UM-Bridge model for a server
// is not checked: only the server knows them.
absl::StatusOr<v1::Problem> ReadCheckedProblem(const std::string& path, const Place& place);

// Refuses two files with INVALID_ARGUMENT when the first is CSV data and the second a problem.
absl::Status CheckFilesAreNotSwapped(const std::string& problem_file, const std::string& data_file);

// Reads a checked problem and the data for it, and warns of data that are probably not what was
// meant. Returns their files.
absl::StatusOr<InputFiles> ReadProblemAndData(const std::string& problem_file,
                                              const std::string& data_file, const Place& place,
                                              v1::Experiment& experiment,
                                              const DataFileOptions& options,
                                              DataWarnings& warnings);

// Returns what the arguments say about the data file; the defaults if their command says nothing.
template <typename Arguments>
DataFileOptions DataOptionsOf(const Arguments& arguments) {
  if constexpr (requires { arguments.data_options; }) return arguments.data_options;
  return {};
}

// Fills in the subject of a request: the session that the arguments name, if their command takes
// one, or else the problem and the data in their two files, which it returns.
template <typename Arguments, typename Request>
absl::StatusOr<InputFiles> FillInput(const Arguments& arguments, Request& request) {
  if constexpr (requires { arguments.session; }) {
    if (!arguments.session.empty()) {
      request.mutable_subject()->set_session(absl::StrCat("sessions/", arguments.session));
      return InputFiles();
    }
  }
  DataWarnings warnings;
  return ReadProblemAndData(arguments.problem_file, arguments.data_file, arguments.place,
                            *request.mutable_subject()->mutable_experiment(),
                            DataOptionsOf(arguments), warnings);
}

// Returns the problem of a subject that FillInput has filled in; asks the daemon for a session's.
absl::StatusOr<v1::Problem> ProblemOf(const v1::Subject& subject, const Place& place);

}  // namespace polyest::internal
