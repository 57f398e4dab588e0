#pragma once

// A problem as the commands take it: read from a file and checked whole before any data are read
// or sent, so that what is wrong with the problem is not blamed on the data.

#include <absl/status/statusor.h>

#include <string>

#include "client/cli/arguments.h"
#include "polyest/v1/problem.pb.h"

namespace polyest {

// INVALID_ARGUMENT, opening with the file's name, for all that is wrong with the file or with the
// problem in it. Which FMUs a server has, only it knows: a problem with one is then left to it.
absl::StatusOr<v1::Problem> ReadCheckedProblem(const std::string& path, const Place& place);

}  // namespace polyest
