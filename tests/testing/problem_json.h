#pragma once

#include <google/protobuf/util/json_util.h>

#include <string>

#include "core/common/check.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// A problem as its file would have it.
inline v1::Problem ProblemFromJson(const std::string& json) {
  v1::Problem problem;
  POLYEST_CHECK(google::protobuf::util::JsonStringToMessage(json, &problem).ok());
  return problem;
}

// One unknown, a quarter of a second of work at most.
inline v1::Problem SmallProblem() {
  return ProblemFromJson(R"({
    "model": {"builtin": "mass_spring_damper"},
    "fixed": {"m": 1, "k": 39.478, "c": 0.2},
    "uncertain": [{"name": "v0", "uniform": {"lower": 0.5, "upper": 1.5}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  })");
}

}  // namespace polyest::internal
