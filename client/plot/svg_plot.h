#pragma once

// Draws plots as SVG text: a grid of panels, each with lines or contours, under one title and with
// one legend for all panels. The text is self-contained: it has no script, no style sheet, and no
// font but the viewer's sans-serif.

#include <optional>
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

// The area between two lines.
struct BandSeries {
  std::string label;
  std::string color;
  std::vector<double> x;
  std::vector<double> lower;  // the area has a gap where lower or upper is not finite
  std::vector<double> upper;
};

// A vertical line across a panel.
struct VerticalLine {
  std::string label;
  std::string color;
  double x = 0;
};

// A horizontal line across a panel.
struct HorizontalLine {
  std::string label;
  std::string color;
  double y = 0;
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
  std::vector<BandSeries> areas;
  std::vector<VerticalLine> vertical_lines;
  std::vector<HorizontalLine> horizontal_lines;
  std::vector<LineSeries> series;
  // The ranges of the axes; by default those of the content.
  std::optional<std::pair<double, double>> x_range;
  std::optional<std::pair<double, double>> y_range;
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
  Matrix value;                          // x × y
  std::vector<double> levels;            // increasing
  std::vector<std::string> level_texts;  // one for each level; empty: some levels' numbers
  std::vector<PointMark> points;
};

// A place in the grid that is left free.
struct EmptyPanel {};

using Panel = std::variant<LinePanel, ContourPanel, EmptyPanel>;

// The opacity of all bands and areas.
inline constexpr double kBandOpacity = 0.25;

struct Plot {
  std::string title;
  std::string description;            // for screen readers
  int columns = 2;                    // panels side by side
  double panel_width = 420;           // with its labels, pixels
  double panel_height = 320;          // with its labels, pixels
  std::vector<double> column_widths;  // of the first columns, where they differ from panel_width
  std::vector<Panel> panels;          // row by row
};

// Returns the SVG file of a plot. Coordinates are rounded to a hundredth of a pixel, so that equal
// plots give equal texts.
std::string RenderSvg(const Plot& plot);

}  // namespace polyest::internal
