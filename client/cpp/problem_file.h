#pragma once

// A problem from a file: the canonical protobuf JSON of polyest.v1.Problem.

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <string>

#include "polyest/v1/problem.pb.h"

namespace polyest {

// INVALID_ARGUMENT, in one line that opens with `name` and, where the parser tells, the line or the
// field: text that is not JSON, a field that the schema lacks, a value of the wrong type.
absl::StatusOr<v1::Problem> ParseProblem(absl::string_view json, absl::string_view name);

// The same from a file, which may be up to 16 MiB long.
absl::StatusOr<v1::Problem> ReadProblemFile(const std::string& path);

}  // namespace polyest
