#include "client/plot/svg_writer.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

namespace polyest::internal {
namespace {

// Formats a coordinate to a hundredth of a pixel.
std::string Number(double value) {
  std::string text = absl::StrFormat("%.2f", value);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string StrokeAttributes(const SvgStroke& stroke) {
  std::string text = absl::StrCat(" stroke=\"", EscapeXml(stroke.color), "\" stroke-width=\"",
                                  Number(stroke.width), "\"");
  if (!stroke.dashes.empty()) {
    absl::StrAppend(&text, " stroke-dasharray=\"", EscapeXml(stroke.dashes), "\"");
  }
  return text;
}

void AppendPoints(const std::vector<std::array<double, 2>>& points, std::string& text) {
  const char* separator = "";
  for (const auto& [x, y] : points) {
    absl::StrAppend(&text, separator, Number(x), ",", Number(y));
    separator = " ";
  }
}

}  // namespace

std::string EscapeXml(std::string_view text) {
  std::string escaped;
  for (char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&apos;";
        break;
      default:
        escaped += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return escaped;
}

SvgWriter::SvgWriter(double width, double height, std::string_view title,
                     std::string_view description) {
  const std::string w = Number(width), h = Number(height);
  absl::StrAppend(&text_, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n",
                  "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"", w, "\" height=\"", h,
                  "\" viewBox=\"0 0 ", w, " ", h,
                  "\" font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" role=\"img\">\n",
                  "<title>", EscapeXml(title), "</title>\n<desc>", EscapeXml(description),
                  "</desc>\n");
  Rectangle(0, 0, width, height, "#ffffff");
}

void SvgWriter::Line(double x1, double y1, double x2, double y2, const SvgStroke& stroke) {
  absl::StrAppend(&text_, "<line x1=\"", Number(x1), "\" y1=\"", Number(y1), "\" x2=\"", Number(x2),
                  "\" y2=\"", Number(y2), "\"", StrokeAttributes(stroke), "/>\n");
}

size_t VisibleLength(std::string_view text) {
  return std::count_if(text.begin(), text.end(),
                       [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; });
}

void SvgWriter::Area(const std::vector<std::array<double, 2>>& border, std::string_view fill,
                     double opacity) {
  if (border.size() < 3) return;
  absl::StrAppend(&text_, "<polygon fill=\"", EscapeXml(fill), "\" fill-opacity=\"",
                  Number(opacity), "\" points=\"");
  AppendPoints(border, text_);
  absl::StrAppend(&text_, "\"/>\n");
}

void SvgWriter::Polyline(const std::vector<std::array<double, 2>>& points, bool closed,
                         const SvgStroke& stroke) {
  if (points.size() < 2) return;
  absl::StrAppend(&text_, closed ? "<polygon" : "<polyline",
                  " fill=\"none\" stroke-linejoin=\"round\"", StrokeAttributes(stroke),
                  " points=\"");
  AppendPoints(points, text_);
  absl::StrAppend(&text_, "\"/>\n");
}

void SvgWriter::Rectangle(double x, double y, double width, double height, std::string_view fill,
                          double opacity) {
  absl::StrAppend(&text_, "<rect x=\"", Number(x), "\" y=\"", Number(y), "\" width=\"",
                  Number(width), "\" height=\"", Number(height), "\" fill=\"", EscapeXml(fill),
                  "\"");
  if (opacity < 1) absl::StrAppend(&text_, " fill-opacity=\"", Number(opacity), "\"");
  absl::StrAppend(&text_, "/>\n");
}

void SvgWriter::Circle(double x, double y, double radius, std::string_view fill,
                       std::string_view stroke) {
  absl::StrAppend(&text_, "<circle cx=\"", Number(x), "\" cy=\"", Number(y), "\" r=\"",
                  Number(radius), "\" fill=\"", EscapeXml(fill), "\" stroke=\"", EscapeXml(stroke),
                  "\" stroke-width=\"1.2\"/>\n");
}

void SvgWriter::Text(double x, double y, std::string_view text, const SvgTextStyle& style) {
  absl::StrAppend(&text_, "<text x=\"", Number(x), "\" y=\"", Number(y), "\" font-size=\"",
                  Number(style.size), "\" text-anchor=\"", EscapeXml(style.anchor), "\" fill=\"",
                  EscapeXml(style.color), "\"");
  if (style.bold) absl::StrAppend(&text_, " font-weight=\"bold\"");
  if (style.rotation_deg != 0) {
    absl::StrAppend(&text_, " transform=\"rotate(", Number(style.rotation_deg), " ", Number(x), " ",
                    Number(y), ")\"");
  }
  absl::StrAppend(&text_, ">", EscapeXml(text), "</text>\n");
}

void SvgWriter::BeginClip(double x, double y, double width, double height) {
  const std::string id = absl::StrCat("clip", ++clips_);
  absl::StrAppend(&text_, "<clipPath id=\"", id, "\"><rect x=\"", Number(x), "\" y=\"", Number(y),
                  "\" width=\"", Number(width), "\" height=\"", Number(height),
                  "\"/></clipPath>\n<g clip-path=\"url(#", id, ")\">\n");
}

void SvgWriter::EndClip() { absl::StrAppend(&text_, "</g>\n"); }

std::string SvgWriter::Finish() {
  text_ += "</svg>\n";
  return std::move(text_);
}

}  // namespace polyest::internal
