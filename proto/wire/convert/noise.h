#pragma once

// Converts the noise of a measured output.

#include <absl/status/statusor.h>

#include "polyest/noise.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// Returns what is done about gross errors. An error names the field `outliers`.
absl::StatusOr<OutlierHandling> ToOutlierHandling(const v1::MeasuredOutput::Noise& noise);

// Returns the noise. An error names its field within the noise.
absl::StatusOr<NoiseModel> ToNoise(const v1::MeasuredOutput::Noise& given);

}  // namespace polyest::internal
