#pragma once

#include "client/paper/experiments.h"
#include "client/paper/svg_plot.h"

namespace polyest::internal {

// The figure of an experiment: what was measured at the reference values with the sample
// times marked, and the cost over the germ ξ with the true value and the estimate.
Plot MakePlot(const ExperimentResult& result);

}  // namespace polyest::internal
