#pragma once

// Reads a problem from a file, which holds the canonical protobuf JSON of polyest.v1.Problem.

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <string>

#include "polyest/v1/problem.pb.h"

namespace polyest {

// Reads a problem from text. INVALID_ARGUMENT for text that is not JSON, for unknown fields (it
// names all of them, each with the nearest known name), for a value of the wrong type and for a
// uniform or beta prior without one of its bounds. The message is one line that begins with `name`
// and, for text that is not JSON, the line and column, or else the field.
absl::StatusOr<v1::Problem> ParseProblem(absl::string_view json, absl::string_view name);

// Reads a problem from a file of at most 16 MiB; every message begins with the file's name.
absl::StatusOr<v1::Problem> ReadProblemFile(const std::string& path);

}  // namespace polyest
