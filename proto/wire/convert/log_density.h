#pragma once

// Converts the requests and the responses of ComputeLogDensity.

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "polyest/log_density.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Returns the options of a request with points. INVALID_ARGUMENT if its values are no rows of one
// value for each of the parameters.
absl::StatusOr<LogDensityOptions> ToLogDensityOptions(const v1::ComputeLogDensityRequest& request,
                                                      const std::vector<std::string>& parameters);
// Converts densities. `sequence` stays 0: only the session knows it.
v1::ComputeLogDensityResponse ToProto(const LogDensity& density);

}  // namespace polyest::internal
