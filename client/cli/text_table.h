#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace polyest::internal {

// Rows of a curve in a table: a person reads fewer than a plot takes.
inline constexpr int kTablePoints = 17;

// Columns of text, aligned by what a terminal shows.
//
// On a screen that is narrower than the table (screen.h), columns of prose are broken at blanks
// first; what still does not fit goes into further tables below, each with the first column again.
class TextTable {
 public:
  enum class Align { kLeft, kRight };

  explicit TextTable(std::vector<std::string> header, Align align = Align::kLeft);
  // Takes as many cells as the header has.
  void AddRow(std::vector<std::string> cells);
  // Returns the number of places that the longest line takes.
  int Width() const;
  // Separates columns by two spaces and leaves none at the end of a line.
  void Print(std::ostream& out) const;

 private:
  using Widths = std::vector<int>;

  Widths NaturalWidths() const;
  // Narrows columns of prose until the table has that many places, or none is left.
  void Narrow(Widths& widths, int places) const;
  bool IsProse(size_t column) const;
  void PrintColumns(const std::vector<size_t>& columns, const Widths& widths,
                    std::ostream& out) const;

  std::vector<std::vector<std::string>> rows_;  // the header first
  Align align_;
};

}  // namespace polyest::internal
