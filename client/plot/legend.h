#pragma once

// The legend of a plot: one entry for each label, in rows below the panels.

#include <string>
#include <vector>

#include "client/plot/svg_plot.h"
#include "client/plot/svg_writer.h"

namespace polyest::internal {

struct LegendEntry {
  enum Kind { kLine, kMarker, kBand } kind;
  std::string label, color, dashes;
};

class Legend {
 public:
  explicit Legend(const Plot& plot);

  // Returns the height of the legend in a plot of this width, pixels.
  double Height(double width) const;
  // Draws the legend below `top`.
  void Draw(double width, double top, SvgWriter& svg) const;

 private:
  void Add(LegendEntry entry);
  void AddPanel(const LinePanel& panel);
  void AddPanel(const ContourPanel& panel);
  void AddPanel(const EmptyPanel&) {}
  std::vector<std::vector<LegendEntry>> Rows(double width) const;

  std::vector<LegendEntry> entries_;
};

// Returns the dashes of a line of this style; empty: solid.
std::string Dashes(LineStyle style);

}  // namespace polyest::internal
