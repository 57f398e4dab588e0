#pragma once

// Converts the request and the response of Predict.

#include <absl/status/statusor.h>

#include "polyest/model.h"
#include "polyest/prediction.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Converts the options. Errors are those of the other record's conversion (measurements.h), within
// `record`.
absl::StatusOr<PredictionOptions> ToPredictionOptions(const v1::PredictRequest& request,
                                                      const Model& model);

// Converts a prediction that was computed with `options`. `sequence` stays 0: only the session
// knows it.
v1::PredictResponse ToProto(const Prediction& prediction, const PredictionOptions& options);

}  // namespace polyest::internal
