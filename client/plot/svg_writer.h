#pragma once

// Writes the elements of an SVG file as text, with special characters escaped.

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace polyest::internal {

struct SvgStroke {
  std::string color = "#000000";
  double width = 1;
  std::string dashes;  // as in "6 3"; empty: solid
};

struct SvgTextStyle {
  double size = 12;
  std::string anchor = "middle";  // start, middle, end
  std::string color = "#222222";
  bool bold = false;
  double rotation_deg = 0;  // about the text's own position
};

class SvgWriter {
 public:
  SvgWriter(double width, double height, std::string_view title, std::string_view description);

  void Line(double x1, double y1, double x2, double y2, const SvgStroke& stroke);
  void Polyline(const std::vector<std::array<double, 2>>& points, bool closed,
                const SvgStroke& stroke);
  // Fills a closed line.
  void Area(const std::vector<std::array<double, 2>>& border, std::string_view fill,
            double opacity);
  void Rectangle(double x, double y, double width, double height, std::string_view fill,
                 double opacity = 1);
  void Circle(double x, double y, double radius, std::string_view fill, std::string_view stroke);
  void Text(double x, double y, std::string_view text, const SvgTextStyle& style);
  // Clips the elements drawn until EndClip to the rectangle.
  void BeginClip(double x, double y, double width, double height);
  void EndClip();

  // Returns the whole file. The writer cannot be used afterwards.
  std::string Finish();

 private:
  std::string text_;
  int clips_ = 0;
};

// Returns the number of code points of a text in UTF-8, which is about its width.
size_t VisibleLength(std::string_view text);

// Returns the text for a node or an attribute: & < > " ' as entities, control characters as spaces.
std::string EscapeXml(std::string_view text);

}  // namespace polyest::internal
