#pragma once

#include "client/paper/svg_plot.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// The L-curve, the evidence and each parameter's estimate over log₁₀ α², with the α² of the rules.
Plot MakePlot(const v1::ComputeRegularizationSweepResponse& response);

}  // namespace polyest::internal
