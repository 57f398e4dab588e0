#pragma once

#include "client/paper/svg_plot.h"
#include "polyest/v1/estimation_service.pb.h"

namespace polyest {

// The L-curve, the evidence and each parameter's estimate over log₁₀ α², with the α² of the rules.
Plot MakePlot(const v1::SweepRegularizationResponse& response);

}  // namespace polyest
