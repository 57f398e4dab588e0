#pragma once

// Request and answer of SweepRegularization.

#include "core/estimator/regularization_sweep.h"
#include "polyest/v1/estimation_service.pb.h"

namespace polyest {

RegularizationOptions ToRegularizationOptions(const v1::SweepRegularizationRequest& request);
// `sequence` stays 0.
v1::SweepRegularizationResponse ToProto(const RegularizationSweep& sweep);

}  // namespace polyest
