#pragma once

#include <google/protobuf/util/json_util.h>

#include <string>

#include "core/common/check.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// Returns the problem given by the JSON text of a problem file.
inline v1::Problem ProblemFromJson(const std::string& json) {
  v1::Problem problem;
  POLYEST_CHECK(google::protobuf::util::JsonStringToMessage(json, &problem).ok());
  return problem;
}

// Returns a problem with one unknown that takes at most a quarter of a second.
inline v1::Problem SmallProblem() {
  return ProblemFromJson(R"({
    "model": {"builtin": "mass_spring_damper"},
    "fixed": {"m": 1, "k": 39.478, "c": 0.2},
    "uncertain": [{"name": "v0", "uniform": {"lower": 0.5, "upper": 1.5}}],
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}]
  })");
}

}  // namespace polyest::internal
