#include "client/plot/contour_panel.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "client/plot/contours.h"

namespace polyest::internal {
namespace {

constexpr Eigen::Index kRefinement = 4;  // cells of the fine grid in a cell, on each axis

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

  void Add(const ContourLine& line, const std::string& text, const std::string& color) {
    const double width = 5.8 * VisibleLength(text) + 4;
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
  // Contours between few values would have corners.
  const ContourGrid fine = RefinedGrid(panel.x, panel.y, panel.value, kRefinement);
  LevelTexts texts(frame);
  for (const PointMark& point : panel.points) texts.Avoid(point.x, point.y);
  const size_t count = panel.levels.size();
  for (size_t l = 0; l < count; ++l) {
    const std::string color =
        LevelColor(count > 1 ? static_cast<double>(l) / static_cast<double>(count - 1) : 0);
    const ContourLine* longest = nullptr;
    const auto lines = ContourLines(fine.x, fine.y, fine.value, panel.levels[l]);
    for (const ContourLine& line : lines) {
      if (longest == nullptr || line.points.size() > longest->points.size()) longest = &line;
      std::vector<std::array<double, 2>> pixels;
      for (const auto& [px, py] : line.points) pixels.push_back({frame.X(px), frame.Y(py)});
      svg.Polyline(pixels, line.closed, {color, 1.4, ""});
    }
    if (longest == nullptr) continue;
    if (!panel.level_texts.empty()) {
      texts.Add(*longest, panel.level_texts[l], color);
    } else if (l % 3 == 0) {
      texts.Add(*longest, LevelText(panel.levels[l]), color);
    }
  }
  texts.Draw(svg);
}

}  // namespace

void DrawContourPanel(const ContourPanel& panel, const PanelPlace& place, SvgWriter& svg) {
  const Range xs{panel.x(0), panel.x(panel.x.size() - 1)};
  const Range ys{panel.y(0), panel.y(panel.y.size() - 1)};
  const PanelFrame frame(place, xs, ys);
  frame.DrawGrid(svg);
  frame.BeginContent(svg);
  DrawContours(panel, frame, svg);
  for (const PointMark& p : panel.points) {
    svg.Circle(frame.X(p.x), frame.Y(p.y), 5, p.color, "#ffffff");
  }
  svg.EndClip();
  frame.DrawLabels(panel.title, panel.x_label, panel.y_label, svg);
}

}  // namespace polyest::internal
