#pragma once

// Reads what the commands compute from: a problem and data from files, or a session of a daemon. A
// problem is checked whole before any data are read or sent, so that what is wrong with the problem
// is not blamed on the data.

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <string>

#include "client/cli/arguments.h"
#include "client/cli/exit_status.h"
#include "core/common/status.h"
#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Reads a problem and checks it. INVALID_ARGUMENT, opening with the file's name, for all that is
// wrong with the file or with the problem in it. Which FMUs a server has, only it knows: a problem
// with one is then left to it.
absl::StatusOr<v1::Problem> ReadCheckedProblem(const std::string& path, const Place& place);

// INVALID_ARGUMENT when the first file is CSV data and the second a problem.
absl::Status CheckFilesAreNotSwapped(const std::string& problem_file, const std::string& data_file);

// Reads a checked problem and the data for it.
absl::Status ReadProblemAndData(const std::string& problem_file, const std::string& data_file,
                                const Place& place, v1::Problem& problem,
                                v1::Measurements& measurements);

// Fills in what a request computes from: the session that the arguments name, if their command
// takes one, or else their two files.
template <typename Arguments, typename Request>
absl::Status FillInput(const Arguments& arguments, Request& request) {
  if constexpr (requires { arguments.session; }) {
    if (!arguments.session.empty()) {
      request.mutable_subject()->set_session(absl::StrCat("sessions/", arguments.session));
      return absl::OkStatus();
    }
  }
  v1::Experiment& experiment = *request.mutable_subject()->mutable_experiment();
  return ReadProblemAndData(arguments.problem_file, arguments.data_file, arguments.place,
                            *experiment.mutable_problem(), *experiment.mutable_measurements());
}

// Puts the name of the file in front of the refusal of one of its fields; leaves alone what a
// daemon says of a session.
template <typename Arguments>
absl::Status InInput(const absl::Status& status, const Arguments& arguments) {
  if constexpr (requires { arguments.session; }) {
    if (!arguments.session.empty()) return status;
  }
  return InFile(status, arguments.problem_file, arguments.data_file);
}

}  // namespace polyest::internal
