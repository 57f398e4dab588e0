#pragma once

#include "client/plot/svg_plot.h"
#include "polyest/v1/estimate.pb.h"

namespace polyest::internal {

// Returns a plot of each parameter's estimate with its 95 % interval while measurements came in:
// over time, or over the number of samples if there are several runs. A parameter of a run has a
// gap where the run had not begun.
Plot MakePlot(const v1::EstimateHistory& history);

}  // namespace polyest::internal
