#include "client/plot/legend.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace polyest::internal {
namespace {

// Sizes in pixels.
constexpr double kRowHeight = 24, kLegendMargin = 12;
constexpr double kSymbolWidth = 44;
constexpr double kCharacterWidth = 7;  // on average

double WidthOf(const LegendEntry& entry) {
  return kSymbolWidth + kCharacterWidth * VisibleLength(entry.label);
}

void DrawRow(const std::vector<LegendEntry>& row, double width, double y, SvgWriter& svg) {
  double total = 0;
  for (const LegendEntry& entry : row) total += WidthOf(entry);
  double x = (width - total) / 2;
  for (const LegendEntry& entry : row) {
    switch (entry.kind) {
      case LegendEntry::kLine:
        svg.Line(x, y, x + 26, y, {entry.color, 2, entry.dashes});
        break;
      case LegendEntry::kMarker:
        svg.Circle(x + 13, y, 4.5, entry.color, "#ffffff");
        break;
      case LegendEntry::kBand:
        svg.Rectangle(x, y - 6, 26, 12, entry.color, kBandOpacity);
        break;
    }
    svg.Text(x + 32, y + 4, entry.label, {.size = 12, .anchor = "start"});
    x += WidthOf(entry);
  }
}

}  // namespace

std::string Dashes(LineStyle style) {
  switch (style) {
    case LineStyle::kDashed:
      return "7 4";
    case LineStyle::kDotted:
      return "2 3";
    case LineStyle::kSolid:
    case LineStyle::kMarkers:
      break;
  }
  return "";
}

Legend::Legend(const Plot& plot) {
  for (const Panel& panel : plot.panels) {
    std::visit([this](const auto& one) { AddPanel(one); }, panel);
  }
}

void Legend::Add(LegendEntry entry) {
  if (entry.label.empty()) return;
  for (const LegendEntry& known : entries_) {
    if (known.label == entry.label) return;
  }
  entries_.push_back(std::move(entry));
}

void Legend::AddPanel(const LinePanel& panel) {
  for (const LineSeries& series : panel.series) {
    const bool marker = series.style == LineStyle::kMarkers;
    Add({marker ? LegendEntry::kMarker : LegendEntry::kLine, series.label, series.color,
         Dashes(series.style)});
  }
  for (const BandSeries& area : panel.areas) Add({LegendEntry::kBand, area.label, area.color, ""});
  for (const VerticalLine& line : panel.vertical_lines) {
    Add({LegendEntry::kLine, line.label, line.color, "4 4"});
  }
  for (const HorizontalLine& line : panel.horizontal_lines) {
    Add({LegendEntry::kLine, line.label, line.color, "4 4"});
  }
  for (const VerticalBand& band : panel.bands)
    Add({LegendEntry::kBand, band.label, band.color, ""});
}

void Legend::AddPanel(const ContourPanel& panel) {
  for (const PointMark& point : panel.points) {
    Add({LegendEntry::kMarker, point.label, point.color, ""});
  }
}

std::vector<std::vector<LegendEntry>> Legend::Rows(double width) const {
  std::vector<std::vector<LegendEntry>> rows;
  double used = 0;
  for (const LegendEntry& entry : entries_) {
    if (rows.empty() || (used > 0 && used + WidthOf(entry) > width - 2 * kLegendMargin)) {
      rows.emplace_back();
      used = 0;
    }
    rows.back().push_back(entry);
    used += WidthOf(entry);
  }
  return rows;
}

double Legend::Height(double width) const {
  return kRowHeight * static_cast<double>(Rows(width).size()) + kLegendMargin;
}

void Legend::Draw(double width, double top, SvgWriter& svg) const {
  double y = top + 0.5 * kRowHeight;
  for (const std::vector<LegendEntry>& row : Rows(width)) {
    DrawRow(row, width, y, svg);
    y += kRowHeight;
  }
}

}  // namespace polyest::internal
