#pragma once

#include "polyest/estimate.h"
#include "polyest/v1/estimate.pb.h"

namespace polyest::internal {

// `sequence` stays 0: batches are the session's, not the core's.
v1::Estimate ToProto(const Estimate& estimate);

v1::Diagnostic ToProto(const Diagnostic& diagnostic);

}  // namespace polyest::internal
