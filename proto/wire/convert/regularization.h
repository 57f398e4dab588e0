#pragma once

// Request and answer of ComputeRegularizationSweep.

#include "core/estimator/studies/regularization_sweep.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

RegularizationOptions ToRegularizationOptions(const v1::ComputeRegularizationSweepRequest& request);
// `sequence` stays 0.
v1::ComputeRegularizationSweepResponse ToProto(const RegularizationSweep& sweep);

}  // namespace polyest::internal
