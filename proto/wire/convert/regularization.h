#pragma once

// Converts the request and the response of ComputeRegularizationSweep.

#include "core/estimator/studies/regularization_sweep.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

RegularizationOptions ToRegularizationOptions(const v1::ComputeRegularizationSweepRequest& request);
// Converts a sweep. `sequence` stays 0: only the session knows it.
v1::ComputeRegularizationSweepResponse ToProto(const RegularizationSweep& sweep);

}  // namespace polyest::internal
