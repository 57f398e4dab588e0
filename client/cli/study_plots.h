#pragma once

// Plots of the answers of studies.

#include "client/plot/svg_plot.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Returns a corner plot: the density of each parameter, and for each pair of which the joint
// density is there, the regions of highest density that hold 50 % and 95 % of the probability.
Plot MakePlot(const v1::ComputePosteriorResponse& posterior);

// Returns a plot of the cost over each parameter, above its least value.
Plot MakePlot(const v1::ComputeCostProfilesResponse& profiles);

// Returns a plot of each output's mean and spread over time, and of the share of its variance that
// each parameter has a part in.
Plot MakePlot(const v1::ComputeSensitivityResponse& analysis);

// Returns a plot of the gain of the best sample times, and of the parameters' standard deviations
// that they leave; of each candidate.
Plot MakePlot(const v1::ComputeExperimentDesignResponse& design);

}  // namespace polyest::internal
