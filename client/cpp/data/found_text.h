#pragma once

// Says in one line what has been found out about a data file.

#include <cstdint>
#include <string>

#include "client/cpp/data/header.h"
#include "client/cpp/data/row_parser.h"
#include "client/cpp/data/text_encoding.h"

namespace polyest::internal {

struct DataFileFound {
  const Header& header;
  const RowParser& rows;
  Encoding encoding = Encoding::kUtf8;
  int64_t units_line = 0;  // number of the row of units; 0: there is none
  bool whole = true;       // whether all rows have been read
};

// Returns "semicolons, decimal comma; 'Disp [mm]' → x, mm → m; 600,000 rows from 12.345 s". Returns
// an empty text if there is nothing to say but the rows: commas, decimal points, and columns of the
// quantities' own names in the model's units. Where further rows may follow, they are "the first 64
// rows".
std::string FoundText(const DataFileFound& found);

}  // namespace polyest::internal
