#pragma once

// The frame of a panel: axes, grid and labels, and the map from values to pixels.

#include <limits>
#include <string>

#include "client/plot/svg_axis.h"
#include "client/plot/svg_writer.h"

namespace polyest::internal {

// The least and the largest of the finite values; [0, 1] after Pad if there are none.
struct Range {
  double lower = std::numeric_limits<double>::infinity();
  double upper = -std::numeric_limits<double>::infinity();
  void Include(double value);
  // Adds a part of the range to each end.
  void Pad(double part);
};

// The place of a panel with its labels, pixels.
struct PanelPlace {
  double x = 0;
  double y = 0;
  double width = 0;
  double height = 0;
};

// The content of the panel is drawn between BeginContent and SvgWriter::EndClip.
class PanelFrame {
 public:
  PanelFrame(const PanelPlace& place, const Range& xs, const Range& ys);

  // Return the pixels of a value, limited to near the panel, so that no coordinate is beyond a
  // viewer's range.
  double X(double value) const;
  double Y(double value) const;
  double left() const { return left_; }
  double right() const { return right_; }
  double top() const { return top_; }
  double bottom() const { return bottom_; }

  void DrawGrid(SvgWriter& svg) const;
  void DrawLabels(const std::string& title, const std::string& x_label, const std::string& y_label,
                  SvgWriter& svg) const;
  void BeginContent(SvgWriter& svg) const;

 private:
  double top_, bottom_;
  Axis vertical_;
  double tick_width_;  // of the widest text on the vertical axis
  double left_, right_;
  Axis horizontal_;
};

}  // namespace polyest::internal
