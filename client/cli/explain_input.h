#pragma once

// Reads what `polyest explain` speaks of: the estimate from files, or that of a session.

#include <absl/status/statusor.h>

#include "client/cli/arguments.h"
#include "client/cli/backend.h"
#include "polyest/v1/estimate.pb.h"
#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

struct ExplainInput {
  v1::Problem problem;
  v1::Estimate estimate;
  // Has the first run at least, with time, run and streamed inputs. Empty for a session whose
  // problem streams no input.
  v1::Measurements measurements;
  int rows = 0;  // that the record has, about
};

absl::StatusOr<ExplainInput> ReadExplainInput(const ExplainArguments& arguments, Backend& backend);

}  // namespace polyest::internal
