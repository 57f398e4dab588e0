#pragma once

// Plots as SVG text: panels of lines or of contours in a grid under one title, with one legend
// for all. Self-contained: no script, no style sheet, no font but the viewer's sans-serif.

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

enum class LineStyle { kSolid, kDashed, kDotted, kMarkers };

struct LineSeries {
  std::string label;  // in the legend; empty: not in it
  std::string color;
  LineStyle style = LineStyle::kSolid;
  std::vector<double> x;
  std::vector<double> y;  // the line breaks where it is not finite
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
  std::string description;  // for readers that cannot see
  int columns = 2;          // panels side by side
  std::vector<Panel> panels;
};

// The whole file. Numbers have a precision of a hundredth of a pixel, so that the same plot is the
// same text.
std::string RenderSvg(const Plot& plot);

}  // namespace polyest::internal
