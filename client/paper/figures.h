#pragma once

#include "client/paper/experiments.h"
#include "client/plot/svg_plot.h"

namespace polyest::internal {

// Returns the figure of an experiment: the outputs at the reference values with the measurements,
// and the cost over the germ ξ with the true value and the estimate.
Plot MakePlot(const ExperimentResult& result);

}  // namespace polyest::internal
