#pragma once

#include <string>

#include "core/bayes/prior.h"
#include "core/common/types.h"

namespace polyest::internal {

// A trajectory that was left out of an expansion, with the parameters for which it failed.
struct FailedTrajectory {
  Vector theta;        // θ (n), in SI units
  int run = 0;         // in which it failed
  double time_s = 0;   // of the run, up to which it could be integrated
  int flag = 0;        // of the solver
  std::string reason;  // in words
};

// Returns one line with the parameters, the time, the run and the solver's flag.
std::string DescribeFailure(const FailedTrajectory& failure, const Prior& prior);

}  // namespace polyest::internal
