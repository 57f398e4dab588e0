#include "client/plot/svg_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "client/plot/contour_panel.h"
#include "client/plot/legend.h"
#include "client/plot/panel_frame.h"
#include "client/plot/svg_writer.h"

namespace polyest::internal {
namespace {

constexpr double kTitleHeight = 44, kMargin = 12;  // pixels

// Draws one marker of a series. White rings keep few markers apart; many rings would hide the
// markers.
void DrawMarker(const LineSeries& series, size_t i, const PanelFrame& frame, SvgWriter& svg) {
  constexpr size_t kMany = 100;
  const bool many = series.x.size() > kMany;
  svg.Circle(frame.X(series.x[i]), frame.Y(series.y[i]), many ? 0.7 : 4.5, series.color,
             many ? std::string_view(series.color) : "#ffffff");
}

void DrawSeries(const LineSeries& series, const PanelFrame& frame, SvgWriter& svg) {
  std::vector<std::array<double, 2>> run;
  const auto flush = [&] {
    svg.Polyline(run, false, {series.color, 2, Dashes(series.style)});
    run.clear();
  };
  for (size_t i = 0; i < series.x.size(); ++i) {
    if (!std::isfinite(series.y[i])) {
      flush();
    } else if (series.style == LineStyle::kMarkers) {
      DrawMarker(series, i, frame, svg);
    } else {
      run.push_back({frame.X(series.x[i]), frame.Y(series.y[i])});
    }
  }
  flush();
}

void DrawArea(const BandSeries& area, const PanelFrame& frame, SvgWriter& svg) {
  std::vector<std::array<double, 2>> border;
  const auto flush = [&](size_t begin, size_t end) {
    border.clear();
    for (size_t i = begin; i < end; ++i) {
      border.push_back({frame.X(area.x[i]), frame.Y(area.lower[i])});
    }
    for (size_t i = end; i > begin; --i) {
      border.push_back({frame.X(area.x[i - 1]), frame.Y(area.upper[i - 1])});
    }
    svg.Area(border, area.color, kBandOpacity);
  };
  size_t begin = 0;
  for (size_t i = 0; i < area.x.size(); ++i) {
    if (std::isfinite(area.lower[i]) && std::isfinite(area.upper[i])) continue;
    flush(begin, i);
    begin = i + 1;
  }
  flush(begin, area.x.size());
}

Range VerticalRange(const LinePanel& panel) {
  if (panel.y_range) return {panel.y_range->first, panel.y_range->second};
  Range ys;
  for (const LineSeries& series : panel.series) {
    for (double value : series.y) ys.Include(value);
  }
  for (const BandSeries& area : panel.areas) {
    for (double value : area.lower) ys.Include(value);
    for (double value : area.upper) ys.Include(value);
  }
  for (const HorizontalLine& line : panel.horizontal_lines) ys.Include(line.y);
  ys.Pad(0.05);
  return ys;
}

Range HorizontalRange(const LinePanel& panel) {
  if (panel.x_range) return {panel.x_range->first, panel.x_range->second};
  Range xs;
  for (const LineSeries& series : panel.series) {
    for (double value : series.x) xs.Include(value);
  }
  for (const BandSeries& area : panel.areas) {
    for (double value : area.x) xs.Include(value);
  }
  xs.Pad(0.02);
  return xs;
}

void DrawPanel(const LinePanel& panel, const PanelPlace& place, SvgWriter& svg) {
  const Range xs = HorizontalRange(panel), ys = VerticalRange(panel);
  const PanelFrame frame(place, xs, ys);
  frame.DrawGrid(svg);
  frame.BeginContent(svg);
  for (const VerticalBand& band : panel.bands) {
    const double from = frame.X(std::clamp(band.lower, xs.lower, xs.upper));
    const double to = frame.X(std::clamp(band.upper, xs.lower, xs.upper));
    // At least a pixel, so that a very certain estimate still shows.
    svg.Rectangle(from, frame.top(), std::max(1.0, to - from), frame.bottom() - frame.top(),
                  band.color, kBandOpacity);
  }
  for (const BandSeries& area : panel.areas) DrawArea(area, frame, svg);
  for (const VerticalLine& line : panel.vertical_lines) {
    svg.Line(frame.X(line.x), frame.top(), frame.X(line.x), frame.bottom(),
             {line.color, 1.5, "4 4"});
  }
  for (const HorizontalLine& line : panel.horizontal_lines) {
    svg.Line(frame.left(), frame.Y(line.y), frame.right(), frame.Y(line.y),
             {line.color, 1.5, "4 4"});
  }
  for (const LineSeries& series : panel.series) DrawSeries(series, frame, svg);
  svg.EndClip();
  frame.DrawLabels(panel.title, panel.x_label, panel.y_label, svg);
}

void DrawPanel(const ContourPanel& panel, const PanelPlace& place, SvgWriter& svg) {
  DrawContourPanel(panel, place, svg);
}

void DrawPanel(const EmptyPanel&, const PanelPlace&, SvgWriter&) {}

// Returns the width of each column.
std::vector<double> ColumnWidths(const Plot& plot) {
  const int columns = std::max(1, std::min(plot.columns, static_cast<int>(plot.panels.size())));
  std::vector<double> widths(static_cast<size_t>(columns), plot.panel_width);
  for (size_t i = 0; i < std::min(widths.size(), plot.column_widths.size()); ++i) {
    widths[i] = plot.column_widths[i];
  }
  return widths;
}

}  // namespace

std::string RenderSvg(const Plot& plot) {
  const std::vector<double> widths = ColumnWidths(plot);
  const size_t columns = widths.size();
  const size_t rows = (plot.panels.size() + columns - 1) / columns;
  double width = 2 * kMargin;
  for (const double one : widths) width += one;
  const double legend_top = kTitleHeight + static_cast<double>(rows) * plot.panel_height;
  const Legend legend(plot);

  SvgWriter svg(width, legend_top + legend.Height(width), plot.title, plot.description);
  svg.Text(width / 2, 28, plot.title, {.size = 16, .bold = true});
  PanelPlace place{kMargin, kTitleHeight, 0, plot.panel_height};
  for (size_t i = 0; i < plot.panels.size(); ++i) {
    place.width = widths[i % columns];
    std::visit([&](const auto& panel) { DrawPanel(panel, place, svg); }, plot.panels[i]);
    place.x += place.width;
    if ((i + 1) % columns != 0) continue;
    place.x = kMargin;
    place.y += plot.panel_height;
  }
  legend.Draw(width, legend_top, svg);
  return svg.Finish();
}

}  // namespace polyest::internal
