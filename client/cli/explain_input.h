#pragma once

// Reads the input of `polyest explain`: it estimates from files or gets the estimate of a session.

#include <absl/status/statusor.h>

#include "client/cli/arguments.h"
#include "client/cli/backend.h"
#include "client/cli/input_files.h"
#include "polyest/v1/estimate.pb.h"
#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

struct ExplainInput {
  v1::Problem problem;
  v1::Estimate estimate;
  // The measurements of the files, or those of the session if remedies are to be tried on them. Of
  // other sessions the times and streamed inputs of the first run only, or nothing if the problem
  // has no streamed input.
  v1::Measurements measurements;
  InputFiles files;  // none for a session
  int rows = 0;      // number of rows of the record; approximate for a session
};

// Reads the input. `backend` computes the estimate from files; a session is read from its daemon.
absl::StatusOr<ExplainInput> ReadExplainInput(const ExplainArguments& arguments, Backend& backend);

}  // namespace polyest::internal
