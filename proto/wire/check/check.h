#pragma once

#include "core/external/model_library.h"
#include "polyest/v1/problem_service.pb.h"
#include "proto/wire/convert/problem_limits.h"

namespace polyest::internal {

// Checks a problem and the measurements for it, as ProblemService does. Returns all errors of the
// problem; if it has none, the first error of its size or of the measurements; if there is none
// either, the warnings and a summary of the problem and the data.
v1::CheckProblemResponse CheckProblem(const v1::CheckProblemRequest& request,
                                      const ModelLibrary& models = {},
                                      const ProblemLimits& limits = {});

}  // namespace polyest::internal
