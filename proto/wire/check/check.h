#pragma once

#include "core/fmu/model_library.h"
#include "polyest/v1/problem_service.pb.h"
#include "proto/wire/convert/problem_limits.h"

namespace polyest::internal {

// Tells all that is wrong with a problem and with the measurements for it, as ProblemService does;
// without an error also what deserves a second look, and what the problem and the data say.
v1::CheckProblemResponse CheckProblem(const v1::CheckProblemRequest& request,
                                      const ModelLibrary& models = {},
                                      const ProblemLimits& limits = {});

}  // namespace polyest::internal
