#include "client/cli/text_table.h"

#include <absl/strings/match.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "client/cli/screen.h"
#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr int kGap = 2;
// Least width of a wrapped column. Cells with numbers, units or names are narrower; narrower text
// is hard to read.
constexpr int kMinProse = 32;

int Total(const std::vector<int>& widths) {
  return std::accumulate(widths.begin(), widths.end(), 0) +
         kGap * (static_cast<int>(widths.size()) - 1);
}

}  // namespace

TextTable::TextTable(std::vector<std::string> header, Align align)
    : rows_{std::move(header)}, align_(align) {}

void TextTable::AddRow(std::vector<std::string> cells) {
  POLYEST_CHECK(cells.size() == rows_.front().size());
  rows_.push_back(std::move(cells));
}

TextTable::Widths TextTable::NaturalWidths() const {
  Widths widths(rows_.front().size(), 0);
  for (const auto& row : rows_) {
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], DisplayWidth(row[i]));
  }
  return widths;
}

int TextTable::Width() const { return Total(NaturalWidths()); }

bool TextTable::IsProse(size_t column) const {
  return align_ == Align::kLeft &&
         std::any_of(rows_.begin() + 1, rows_.end(), [&](const auto& row) {
           return DisplayWidth(row[column]) > kMinProse && absl::StrContains(row[column], ' ');
         });
}

void TextTable::Narrow(Widths& widths, int places) const {
  std::vector<size_t> prose;
  for (size_t i = 0; i < widths.size(); ++i) {
    if (IsProse(i)) prose.push_back(i);
  }
  // The widest column comes first.
  std::sort(prose.begin(), prose.end(), [&](size_t a, size_t b) { return widths[a] > widths[b]; });
  for (const size_t i : prose) {
    const int excess = Total(widths) - places;
    if (excess <= 0) return;
    widths[i] = std::max(kMinProse, widths[i] - excess);
  }
}

void TextTable::PrintColumns(const std::vector<size_t>& columns, const Widths& widths,
                             std::ostream& out) const {
  for (const auto& row : rows_) {
    std::vector<std::vector<std::string>> cells;
    size_t lines = 1;
    for (const size_t i : columns) {
      cells.push_back(absl::StrSplit(WrapText(row[i], widths[i]), '\n'));
      lines = std::max(lines, cells.back().size());
    }
    for (size_t k = 0; k < lines; ++k) {
      std::string line;
      for (size_t c = 0; c < columns.size(); ++c) {
        const std::string text = k < cells[c].size() ? cells[c][k] : "";
        const int missing = std::max(0, widths[columns[c]] - DisplayWidth(text));
        const std::string padding(static_cast<size_t>(missing), ' ');
        if (c > 0) line += std::string(kGap, ' ');
        line += align_ == Align::kLeft ? text + padding : padding + text;
      }
      line.erase(line.find_last_not_of(' ') + 1);
      out << line << '\n';
    }
  }
}

void TextTable::Print(std::ostream& out) const {
  Widths widths = NaturalWidths();
  const int places = GetScreen(out).columns;
  if (places > 0) Narrow(widths, places);
  size_t next = 1;
  do {
    std::vector<size_t> columns = {0};
    int width = widths[0];
    while (next < widths.size()) {
      width += kGap + widths[next];
      // Each part has at least one column besides the first, however wide it is.
      if (places > 0 && width > places && columns.size() > 1) break;
      columns.push_back(next++);
    }
    PrintColumns(columns, widths, out);
    if (next < widths.size()) out << '\n';
  } while (next < widths.size());
}

}  // namespace polyest::internal
