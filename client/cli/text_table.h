#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace polyest {

// Columns of text, aligned by what a terminal shows (one place a code point).
class TextTable {
 public:
  enum class Align { kLeft, kRight };

  explicit TextTable(std::vector<std::string> header, Align align = Align::kLeft);
  // As many cells as the header has.
  void AddRow(std::vector<std::string> cells);
  // Two spaces between columns and none at the end of a line.
  void Print(std::ostream& out) const;

 private:
  std::vector<std::vector<std::string>> rows_;  // the header first
  Align align_;
};

}  // namespace polyest
