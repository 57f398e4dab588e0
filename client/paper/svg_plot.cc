#include "client/paper/svg_plot.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "client/paper/contours.h"
#include "client/paper/svg_axis.h"
#include "client/paper/svg_writer.h"

namespace polyest::internal {
namespace {

// Sizes in pixels.
constexpr double kPanelWidth = 420, kPanelHeight = 320;
constexpr double kLeft = 66, kRight = 16, kTop = 40, kBottom = 52;
constexpr double kTitleHeight = 44, kLegendRow = 24, kMargin = 12;
constexpr double kCharacterWidth = 7;  // of the legend's text, on average

constexpr char kGridColor[] = "#e6e6e6", kFrameColor[] = "#888888";

struct LegendEntry {
  enum Kind { kLine, kMarker, kBand } kind;
  std::string label, color, dashes;
  double Width() const { return 44 + kCharacterWidth * VisibleLength(); }

 private:
  // Returns the number of code points of the label.
  double VisibleLength() const {
    return static_cast<double>(std::count_if(label.begin(), label.end(), [](char c) {
      return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
    }));
  }
};

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

class LegendCollector {
 public:
  void Add(LegendEntry entry) {
    if (entry.label.empty()) return;
    for (const LegendEntry& known : entries_) {
      if (known.label == entry.label) return;
    }
    entries_.push_back(std::move(entry));
  }
  void operator()(const LinePanel& panel) {
    for (const LineSeries& s : panel.series) {
      const bool marker = s.style == LineStyle::kMarkers;
      Add({marker ? LegendEntry::kMarker : LegendEntry::kLine, s.label, s.color, Dashes(s.style)});
    }
    for (const VerticalLine& l : panel.vertical_lines) {
      Add({LegendEntry::kLine, l.label, l.color, "4 4"});
    }
    for (const VerticalBand& b : panel.bands) Add({LegendEntry::kBand, b.label, b.color, ""});
  }
  void operator()(const ContourPanel& panel) {
    for (const PointMark& p : panel.points) Add({LegendEntry::kMarker, p.label, p.color, ""});
  }
  // Returns the entries in rows that fit into `width`.
  std::vector<std::vector<LegendEntry>> Rows(double width) const {
    std::vector<std::vector<LegendEntry>> rows(1);
    double used = 0;
    for (const LegendEntry& entry : entries_) {
      if (used > 0 && used + entry.Width() > width) {
        rows.emplace_back();
        used = 0;
      }
      rows.back().push_back(entry);
      used += entry.Width();
    }
    return rows;
  }

 private:
  std::vector<LegendEntry> entries_;
};

void DrawLegendRow(const std::vector<LegendEntry>& row, double width, double y, SvgWriter& svg) {
  double total = 0;
  for (const LegendEntry& entry : row) total += entry.Width();
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
        svg.Rectangle(x, y - 6, 26, 12, entry.color, 0.25);
        break;
    }
    svg.Text(x + 32, y + 4, entry.label, {.size = 12, .anchor = "start"});
    x += entry.Width();
  }
}

// The least and the largest of the finite values; [0, 1] after Pad if there are none.
struct Range {
  double lower = std::numeric_limits<double>::infinity();
  double upper = -std::numeric_limits<double>::infinity();
  void Include(double value) {
    if (!std::isfinite(value)) return;
    lower = std::min(lower, value);
    upper = std::max(upper, value);
  }
  void Pad(double part) {
    if (!(upper >= lower)) *this = {0, 1};
    const double pad = part * (upper - lower);
    lower -= pad;
    upper += pad;
  }
};

// Draws the frame of a panel at (x, y): axes, grid and labels. The content is drawn between
// BeginContent and SvgWriter::EndClip.
class PanelFrame {
 public:
  PanelFrame(double x, double y, const Range& xs, const Range& ys)
      : left_(x + kLeft),
        top_(y + kTop),
        width_(kPanelWidth - kLeft - kRight),
        height_(kPanelHeight - kTop - kBottom),
        horizontal_(MakeAxis(xs.lower, xs.upper, 6, left_, left_ + width_)),
        vertical_(MakeAxis(ys.lower, ys.upper, 6, top_ + height_, top_)) {}

  double X(double value) const { return horizontal_.Pixel(value); }
  // Returns the pixel of a value, limited to near the panel, so that no coordinate is beyond a
  // viewer's range.
  double Y(double value) const {
    return std::clamp(vertical_.Pixel(value), top_ - 2000, top_ + height_ + 2000);
  }
  double left() const { return left_; }
  double right() const { return left_ + width_; }
  double top() const { return top_; }
  double bottom() const { return top_ + height_; }

  void DrawGrid(SvgWriter& svg) const {
    for (const AxisTick& tick : horizontal_.ticks) {
      svg.Line(X(tick.value), top_, X(tick.value), bottom(), {kGridColor, 1, ""});
      svg.Text(X(tick.value), bottom() + 16, tick.text, {.size = 11});
    }
    for (const AxisTick& tick : vertical_.ticks) {
      svg.Line(left_, Y(tick.value), left_ + width_, Y(tick.value), {kGridColor, 1, ""});
      svg.Text(left_ - 6, Y(tick.value) + 4, tick.text, {.size = 11, .anchor = "end"});
    }
    if (vertical_.exponent != 0) {
      svg.Text(left_ - 4, top_ - 6, PowerOfTenText(vertical_.exponent), {.size = 11});
    }
    if (horizontal_.exponent != 0) {
      svg.Text(left_ + width_, bottom() + 32, PowerOfTenText(horizontal_.exponent),
               {.size = 11, .anchor = "end"});
    }
  }
  void DrawLabels(const std::string& title, const std::string& x_label, const std::string& y_label,
                  SvgWriter& svg) const {
    const std::vector<std::array<double, 2>> frame = {
        {left_, top_}, {left_ + width_, top_}, {left_ + width_, bottom()}, {left_, bottom()}};
    svg.Polyline(frame, true, {kFrameColor, 1, ""});
    svg.Text(left_ + width_ / 2, top_ - 12, title, {.size = 13, .bold = true});
    svg.Text(left_ + width_ / 2, bottom() + 36, x_label, {.size = 12});
    svg.Text(left_ - 50, top_ + height_ / 2, y_label, {.size = 12, .rotation_deg = -90});
  }
  void BeginContent(SvgWriter& svg) const { svg.BeginClip(left_, top_, width_, height_); }

 private:
  double left_, top_, width_, height_;
  Axis horizontal_, vertical_;
};

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

void DrawPanel(const LinePanel& panel, double x, double y, SvgWriter& svg) {
  Range xs, ys;
  for (const LineSeries& series : panel.series) {
    for (double value : series.x) xs.Include(value);
    for (double value : series.y) ys.Include(value);
  }
  xs.Pad(0.02);
  ys.Pad(0.05);
  const PanelFrame frame(x, y, xs, ys);
  frame.DrawGrid(svg);
  frame.BeginContent(svg);
  for (const VerticalBand& band : panel.bands) {
    const double from = frame.X(std::clamp(band.lower, xs.lower, xs.upper));
    const double to = frame.X(std::clamp(band.upper, xs.lower, xs.upper));
    // At least a pixel, so that a very certain estimate still shows.
    svg.Rectangle(from, frame.top(), std::max(1.0, to - from), frame.bottom() - frame.top(),
                  band.color, 0.25);
  }
  for (const VerticalLine& line : panel.vertical_lines) {
    svg.Line(frame.X(line.x), frame.top(), frame.X(line.x), frame.bottom(),
             {line.color, 1.5, "4 4"});
  }
  for (const LineSeries& series : panel.series) DrawSeries(series, frame, svg);
  svg.EndClip();
  frame.DrawLabels(panel.title, panel.x_label, panel.y_label, svg);
}

// Returns the colour of a level: from deep blue (`part` 0) through green to yellow (`part` 1).
std::string LevelColor(double part) {
  constexpr double kStops[][3] = {
      {59, 28, 120}, {38, 100, 160}, {30, 150, 140}, {110, 185, 70}, {225, 170, 30}};
  const double at = std::clamp(part, 0.0, 1.0) * 4;
  const int i = std::min(3, static_cast<int>(at));
  const auto mix = [&](int channel) {
    return static_cast<int>(
        std::lround(kStops[i][channel] + (at - i) * (kStops[i + 1][channel] - kStops[i][channel])));
  };
  return absl::StrFormat("#%02x%02x%02x", mix(0), mix(1), mix(2));
}

std::string LevelText(double level) {
  if (std::abs(level) < 1000) return absl::StrFormat("%.3g", level);
  return level < 1e6 ? absl::StrFormat("%.0f", level) : absl::StrFormat("%.2e", level);
}

// Places the numbers of the levels on their lines, each where it does not overlap another one.
class LevelTexts {
 public:
  explicit LevelTexts(const PanelFrame& frame) : frame_(frame) {}

  void Add(const ContourLine& line, double level, const std::string& color) {
    const std::string text = LevelText(level);
    const double width = 5.8 * static_cast<double>(text.size()) + 4;
    const size_t count = line.points.size();
    // Candidates go from the middle of the line outwards, in sixteenths of its length.
    for (const int sixteenth : {8, 5, 11, 3, 13, 2, 14}) {
      const auto [x, y] = line.points[(count - 1) * sixteenth / 16];
      const Box box{frame_.X(x) - width / 2, frame_.Y(y) - 6, width, 12, text, color};
      if (!Fits(box)) continue;
      boxes_.push_back(box);
      return;
    }
  }

  // Keeps the surroundings of a point free.
  void Avoid(double x, double y) {
    boxes_.push_back({frame_.X(x) - 6, frame_.Y(y) - 6, 12, 12, "", ""});
  }

  void Draw(SvgWriter& svg) const {
    for (const Box& box : boxes_) {
      if (box.text.empty()) continue;
      svg.Rectangle(box.x, box.y, box.width, box.height, "#ffffff", 0.9);
      svg.Text(box.x + box.width / 2, box.y + 9, box.text, {.size = 9, .color = box.color});
    }
  }

 private:
  struct Box {
    double x, y, width, height;
    std::string text, color;
  };
  bool Fits(const Box& box) const {
    if (box.x < frame_.left() || box.x + box.width > frame_.right()) return false;
    if (box.y < frame_.top() || box.y + box.height > frame_.bottom()) return false;
    return std::none_of(boxes_.begin(), boxes_.end(), [&](const Box& other) {
      return box.x < other.x + other.width && other.x < box.x + box.width &&
             box.y < other.y + other.height && other.y < box.y + box.height;
    });
  }

  const PanelFrame& frame_;
  std::vector<Box> boxes_;
};

void DrawContours(const ContourPanel& panel, const PanelFrame& frame, SvgWriter& svg) {
  LevelTexts texts(frame);
  for (const PointMark& point : panel.points) texts.Avoid(point.x, point.y);
  const size_t count = panel.levels.size();
  for (size_t l = 0; l < count; ++l) {
    const std::string color =
        LevelColor(count > 1 ? static_cast<double>(l) / static_cast<double>(count - 1) : 0);
    const ContourLine* longest = nullptr;
    const auto lines = ContourLines(panel.x, panel.y, panel.value, panel.levels[l]);
    for (const ContourLine& line : lines) {
      if (longest == nullptr || line.points.size() > longest->points.size()) longest = &line;
      std::vector<std::array<double, 2>> pixels;
      for (const auto& [px, py] : line.points) pixels.push_back({frame.X(px), frame.Y(py)});
      svg.Polyline(pixels, line.closed, {color, 1.4, ""});
    }
    if (longest != nullptr && l % 3 == 0) texts.Add(*longest, panel.levels[l], color);
  }
  texts.Draw(svg);
}

void DrawPanel(const ContourPanel& panel, double x, double y, SvgWriter& svg) {
  const Range xs{panel.x(0), panel.x(panel.x.size() - 1)};
  const Range ys{panel.y(0), panel.y(panel.y.size() - 1)};
  const PanelFrame frame(x, y, xs, ys);
  frame.DrawGrid(svg);
  frame.BeginContent(svg);
  DrawContours(panel, frame, svg);
  for (const PointMark& p : panel.points) {
    svg.Circle(frame.X(p.x), frame.Y(p.y), 5, p.color, "#ffffff");
  }
  svg.EndClip();
  frame.DrawLabels(panel.title, panel.x_label, panel.y_label, svg);
}

}  // namespace

std::string RenderSvg(const Plot& plot) {
  const int panels = static_cast<int>(plot.panels.size());
  const int columns = std::max(1, std::min(plot.columns, panels));
  const int rows = (panels + columns - 1) / columns;
  const double width = columns * kPanelWidth + 2 * kMargin;
  LegendCollector legend;
  for (const Panel& panel : plot.panels) std::visit(legend, panel);
  const auto legend_rows = legend.Rows(width - 2 * kMargin);
  const double legend_top = kTitleHeight + rows * kPanelHeight;
  const double height = legend_top + kLegendRow * static_cast<double>(legend_rows.size()) + kMargin;

  SvgWriter svg(width, height, plot.title, plot.description);
  svg.Text(width / 2, 28, plot.title, {.size = 16, .bold = true});
  for (int i = 0; i < panels; ++i) {
    const double x = kMargin + (i % columns) * kPanelWidth;
    const double y = kTitleHeight + (i / columns) * kPanelHeight;
    std::visit([&](const auto& panel) { DrawPanel(panel, x, y, svg); }, plot.panels[i]);
  }
  for (size_t i = 0; i < legend_rows.size(); ++i) {
    DrawLegendRow(legend_rows[i], width, legend_top + kLegendRow * (static_cast<double>(i) + 0.5),
                  svg);
  }
  return svg.Finish();
}

}  // namespace polyest::internal
