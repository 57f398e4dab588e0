#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace polyest::internal {

// Number of points of a curve in a table, which is smaller than in a plot.
inline constexpr int kTablePoints = 17;

// A table of text, aligned by the width that a terminal shows.
//
// On a screen that is narrower than the table (screen.h), columns of prose are wrapped first.
// Columns that still do not fit are printed in further tables below, which repeat the first column.
class TextTable {
 public:
  enum class Align { kLeft, kRight };

  explicit TextTable(std::vector<std::string> header, Align align = Align::kLeft);
  // Adds a row, which must have as many cells as the header.
  void AddRow(std::vector<std::string> cells);
  // Returns the width of the table without wrapping.
  int Width() const;
  // Prints the table. Columns are separated by two spaces; no line ends with spaces.
  void Print(std::ostream& out) const;

 private:
  using Widths = std::vector<int>;

  Widths NaturalWidths() const;
  // Narrows columns of prose, the widest first, until the table fits into `places` columns of the
  // screen or no column can be narrowed further.
  void Narrow(Widths& widths, int places) const;
  bool IsProse(size_t column) const;
  void PrintColumns(const std::vector<size_t>& columns, const Widths& widths,
                    std::ostream& out) const;

  std::vector<std::vector<std::string>> rows_;  // the header first
  Align align_;
};

}  // namespace polyest::internal
