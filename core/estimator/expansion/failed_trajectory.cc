#include "core/estimator/expansion/failed_trajectory.h"

#include <absl/strings/str_format.h>

namespace polyest::internal {

std::string DescribeFailure(const FailedTrajectory& failure, const Prior& prior) {
  std::string parameters;
  for (int i = 0; i < prior.dimension(); ++i) {
    absl::StrAppendFormat(&parameters, "%s%s = %.6g", i == 0 ? "" : ", ",
                          prior.parameters()[static_cast<size_t>(i)].name, failure.theta[i]);
  }
  return absl::StrFormat("%s at t = %g s (run %d): %s (solver flag %d)", parameters, failure.time_s,
                         failure.run, failure.reason, failure.flag);
}

}  // namespace polyest::internal
