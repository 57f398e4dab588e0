#pragma once

// A problem from a file: the canonical protobuf JSON of polyest.v1.Problem.

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <string>

#include "polyest/v1/problem.pb.h"

namespace polyest {

// Reads a problem from text. INVALID_ARGUMENT, in one line that opens with `name` and, where the
// parser tells, the line or the field: text that is not JSON, fields that the schema lacks (all of
// them, each with the nearest name there is), a value of the wrong type.
absl::StatusOr<v1::Problem> ParseProblem(absl::string_view json, absl::string_view name);

// Reads a problem from a file of at most 16 MiB; its name opens every message.
absl::StatusOr<v1::Problem> ReadProblemFile(const std::string& path);

}  // namespace polyest
