#pragma once

// Reads a problem from a file, which holds the canonical protobuf JSON of polyest.v1.Problem.

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <string>

#include "polyest/v1/problem.pb.h"

namespace polyest {

// Reads a problem from text. Refuses with INVALID_ARGUMENT text that is not JSON, fields that the
// schema does not have (all of them, each with the nearest known name) and a value of the wrong
// type. The message is one line that begins with `name` and, where the parser reports them, the
// line or the field.
absl::StatusOr<v1::Problem> ParseProblem(absl::string_view json, absl::string_view name);

// Reads a problem from a file of at most 16 MiB. Its name begins every message.
absl::StatusOr<v1::Problem> ReadProblemFile(const std::string& path);

}  // namespace polyest
