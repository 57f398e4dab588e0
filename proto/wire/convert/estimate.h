#pragma once

#include "polyest/estimate.h"
#include "polyest/v1/estimate.pb.h"

namespace polyest::internal {

// Converts an estimate. `sequence` stays 0: only the session knows the numbers of its batches.
v1::Estimate ToProto(const Estimate& estimate);

v1::Diagnostic ToProto(const Diagnostic& diagnostic);

// Returns the estimate in short, for a history.
v1::EstimateHistory::Point ToHistoryPoint(const v1::Estimate& estimate);

}  // namespace polyest::internal
