#pragma once

#include "client/plot/svg_plot.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Returns a plot of a prediction with a row of panels for each output: the samples against the
// model with its bands, the residuals in units of their spread, and their autocorrelation. The
// outermost of the probabilities bound the bands.
Plot MakePlot(const v1::PredictResponse& prediction);

}  // namespace polyest::internal
