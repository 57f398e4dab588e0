#pragma once

// Reads the input of the commands: a problem and data from files, or a session of a daemon. A
// problem is checked before any data are read or sent, so that its errors are not reported as
// errors of the data.

#include <absl/status/statusor.h>

#include <string>

#include "client/cli/arguments.h"
#include "client/cli/data_input.h"
#include "client/cli/data_warnings.h"
#include "client/cli/input_files.h"
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
absl::StatusOr<InputFiles> ReadProblemAndData(const ExperimentInput& input,
                                              v1::Experiment& experiment, DataWarnings& warnings);

// Fills in the subject of a request from the problem and the data in two files, which it returns,
// or with the session that is named in their place.
absl::StatusOr<InputFiles> FillSubject(const ExperimentInput& input, v1::Subject& subject);
absl::StatusOr<InputFiles> FillSubject(const StudyInput& input, v1::Subject& subject);

// Returns the problem of a subject that FillSubject has filled in; asks the daemon for a session's.
absl::StatusOr<v1::Problem> ProblemOf(const v1::Subject& subject, const Place& place);

}  // namespace polyest::internal
