#pragma once

#include "client/plot/svg_plot.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Returns a plot of the L-curve, and of the evidence and each parameter's estimate over log₁₀ α²,
// with the α² that the rules choose.
Plot MakePlot(const v1::ComputeRegularizationSweepResponse& response);

}  // namespace polyest::internal
