#include "client/plot/panel_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace polyest::internal {
namespace {

// Sizes in pixels.
constexpr double kLeft = 66, kRight = 16, kTop = 40, kBottom = 52;
constexpr double kTickSize = 11, kTickCharacter = 6.4;
constexpr double kLabelRoom = 26;     // between the ticks' texts and the panel's left border
constexpr double kTickDistance = 62;  // on an axis, about
constexpr double kTickGap = 14;       // between texts of the horizontal axis
constexpr double kBeyond = 2000;      // the farthest that a coordinate lies outside
constexpr char kGridColor[] = "#e6e6e6", kFrameColor[] = "#888888";

double WidestText(const Axis& axis) {
  size_t widest = 0;
  for (const AxisTick& tick : axis.ticks) widest = std::max(widest, VisibleLength(tick.text));
  return kTickCharacter * static_cast<double>(widest);
}

int TickCount(double length) { return std::clamp(static_cast<int>(length / kTickDistance), 2, 8); }

// Returns a horizontal axis whose texts do not touch each other, if two of them have room at all.
Axis HorizontalAxis(const Range& xs, double left, double right) {
  Axis chosen;
  for (int count = TickCount(right - left); count >= 1; --count) {
    Axis axis = MakeAxis(xs.lower, xs.upper, count, left, right);
    if (axis.ticks.size() < 2 && !chosen.ticks.empty()) break;
    const auto ticks = static_cast<double>(axis.ticks.size());
    const bool fits = ticks * (WidestText(axis) + kTickGap) <= right - left;
    chosen = std::move(axis);
    if (fits) break;
  }
  return chosen;
}

}  // namespace

void Range::Include(double value) {
  if (!std::isfinite(value)) return;
  lower = std::min(lower, value);
  upper = std::max(upper, value);
}

void Range::Pad(double part) {
  if (!(upper >= lower)) *this = {0, 1};
  const double pad = part * (upper - lower);
  lower -= pad;
  upper += pad;
}

PanelFrame::PanelFrame(const PanelPlace& place, const Range& xs, const Range& ys)
    : top_(place.y + kTop),
      bottom_(place.y + place.height - kBottom),
      vertical_(MakeAxis(ys.lower, ys.upper, TickCount(1.6 * (bottom_ - top_)), bottom_, top_)),
      tick_width_(WidestText(vertical_)),
      left_(place.x + std::max(kLeft, tick_width_ + kLabelRoom + 6)),
      right_(place.x + place.width - kRight),
      horizontal_(HorizontalAxis(xs, left_, right_)) {}

double PanelFrame::X(double value) const {
  return std::clamp(horizontal_.Pixel(value), left_ - kBeyond, right_ + kBeyond);
}

double PanelFrame::Y(double value) const {
  return std::clamp(vertical_.Pixel(value), top_ - kBeyond, bottom_ + kBeyond);
}

void PanelFrame::DrawGrid(SvgWriter& svg) const {
  for (const AxisTick& tick : horizontal_.ticks) {
    svg.Line(X(tick.value), top_, X(tick.value), bottom_, {kGridColor, 1, ""});
    svg.Text(X(tick.value), bottom_ + 16, tick.text, {.size = kTickSize});
  }
  for (const AxisTick& tick : vertical_.ticks) {
    svg.Line(left_, Y(tick.value), right_, Y(tick.value), {kGridColor, 1, ""});
    svg.Text(left_ - 6, Y(tick.value) + 4, tick.text, {.size = kTickSize, .anchor = "end"});
  }
  if (vertical_.exponent != 0) {
    svg.Text(left_ - 4, top_ - 6, PowerOfTenText(vertical_.exponent), {.size = kTickSize});
  }
  if (horizontal_.exponent != 0) {
    svg.Text(right_, bottom_ + 32, PowerOfTenText(horizontal_.exponent),
             {.size = kTickSize, .anchor = "end"});
  }
}

void PanelFrame::DrawLabels(const std::string& title, const std::string& x_label,
                            const std::string& y_label, SvgWriter& svg) const {
  const std::vector<std::array<double, 2>> frame = {
      {left_, top_}, {right_, top_}, {right_, bottom_}, {left_, bottom_}};
  svg.Polyline(frame, true, {kFrameColor, 1, ""});
  svg.Text((left_ + right_) / 2, top_ - 12, title, {.size = 13, .bold = true});
  svg.Text((left_ + right_) / 2, bottom_ + 36, x_label, {.size = 12});
  const double label_x = left_ - std::max(50.0, tick_width_ + 16);
  svg.Text(label_x, (top_ + bottom_) / 2, y_label, {.size = 12, .rotation_deg = -90});
}

void PanelFrame::BeginContent(SvgWriter& svg) const {
  svg.BeginClip(left_, top_, right_ - left_, bottom_ - top_);
}

}  // namespace polyest::internal
