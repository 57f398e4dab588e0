#pragma once

// Draws plots as SVG text: a grid of panels, each with lines or contours, under one title and with
// one legend for all panels. The text is self-contained: it has no script, no style sheet, and no
// font but the viewer's sans-serif.

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

enum class LineStyle { kSolid, kDashed, kDotted, kMarkers };

struct LineSeries {
  std::string label;  // text in the legend; empty: no entry
  std::string color;
  LineStyle style = LineStyle::kSolid;
  std::vector<double> x;
  std::vector<double> y;  // the line has a gap where y is not finite
};

// A vertical line across a panel.
struct VerticalLine {
  std::string label;
  std::string color;
  double x = 0;
};

// A vertical band across a panel, cut to its range.
struct VerticalBand {
  std::string label;
  std::string color;
  double lower = 0;
  double upper = 0;
};

struct LinePanel {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<VerticalBand> bands;
  std::vector<VerticalLine> vertical_lines;
  std::vector<LineSeries> series;
};

struct PointMark {
  std::string label;
  std::string color;
  double x = 0;
  double y = 0;
};

struct ContourPanel {
  std::string title;
  std::string x_label;
  std::string y_label;
  Vector x;
  Vector y;
  Matrix value;                // x × y
  std::vector<double> levels;  // increasing
  std::vector<PointMark> points;
};

using Panel = std::variant<LinePanel, ContourPanel>;

struct Plot {
  std::string title;
  std::string description;  // for screen readers
  int columns = 2;          // panels side by side
  std::vector<Panel> panels;
};

// Returns the SVG file of a plot. Coordinates are rounded to a hundredth of a pixel, so that equal
// plots give equal texts.
std::string RenderSvg(const Plot& plot);

}  // namespace polyest::internal
