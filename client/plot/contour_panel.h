#pragma once

#include "client/plot/panel_frame.h"
#include "client/plot/svg_plot.h"
#include "client/plot/svg_writer.h"

namespace polyest::internal {

// Draws a panel with contours.
void DrawContourPanel(const ContourPanel& panel, const PanelPlace& place, SvgWriter& svg);

}  // namespace polyest::internal
