#pragma once

#include <absl/status/status.h>

#include <string>

#include "client/plot/svg_plot.h"

namespace polyest::internal {

// Writes a plot to a file whose name ends in .svg or .png; the program rsvg-convert (Debian's
// librsvg2-bin) makes a PNG. INVALID_ARGUMENT names the file and the rule for another ending, or
// for a PNG without that program; UNKNOWN if the file cannot be written.
absl::Status WritePlot(const Plot& plot, const std::string& file);

// Returns OK, or the error of WritePlot for a name of that ending, for a PNG without the program or
// for a file that cannot be written, so that it can be known before anything is computed. An empty
// name is OK: no plot is asked for.
absl::Status CheckPlotFile(const std::string& file);

}  // namespace polyest::internal
