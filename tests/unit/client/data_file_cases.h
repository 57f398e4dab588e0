#pragma once

// Descriptions of data files for the tests of how they are read.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "polyest/data_file.h"

namespace polyest::internal {

using Change = std::function<void(DataColumns&)>;

// Returns the columns of a problem with the outputs x, in m, and F, in N.
inline DataColumns XAndForce() {
  DataColumns columns;
  columns.measured = {"x", "F"};
  columns.units = {{"x", "m"}, {"F", "N"}};
  return columns;
}

// Returns a column's values; `-` stands for a missing sample.
inline std::string ValuesOf(const v1::Measurements::Channel& channel) {
  std::vector<std::string> values;
  for (const double value : channel.values()) values.push_back(absl::StrCat(value));
  for (const int32_t row : channel.missing()) values[static_cast<size_t>(row)] = "-";
  return absl::StrCat(channel.name(), "=", absl::StrJoin(values, ","));
}

// Returns "t=0,1 x=2,-", or the message of the refusal.
inline std::string Outcome(const std::string& text, const Change& change,
                           std::string* found = nullptr,
                           int64_t batch = std::numeric_limits<int64_t>::max()) {
  DataColumns columns = XAndForce();
  if (change) change(columns);
  std::istringstream in(text);
  auto reader = DataReader::Open(in, "d.csv", columns);
  if (!reader.ok()) return std::string(reader.status().message());
  const auto data = reader->Read(batch);
  if (found != nullptr) *found = reader->Found();
  if (!data.ok()) return std::string(data.status().message());
  std::string outcome = absl::StrCat("t=", absl::StrJoin(data->time_s(), ","));
  if (!data->run().empty()) absl::StrAppend(&outcome, " run=", absl::StrJoin(data->run(), ","));
  for (const auto& channel : data->channels()) absl::StrAppend(&outcome, " ", ValuesOf(channel));
  return outcome;
}

// Returns ASCII text in UTF-16.
inline std::string Utf16(const std::string& ascii, bool big_endian, bool mark) {
  std::string bytes = !mark ? "" : big_endian ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : ascii) {
    if (big_endian) bytes += '\0';
    bytes += c;
    if (!big_endian) bytes += '\0';
  }
  return bytes;
}

inline void DecimalComma(DataColumns& c) { c.options.decimal = ','; }
inline void DecimalPoint(DataColumns& c) { c.options.decimal = '.'; }
inline void TimeFirst(DataColumns& c) { c.options.time_zero = DataFileOptions::TimeZero::kFirst; }
inline void TimeFile(DataColumns& c) { c.options.time_zero = DataFileOptions::TimeZero::kFile; }
inline void DayFirst(DataColumns& c) {
  c.options.date_order = DataFileOptions::DateOrder::kDayFirst;
}
inline void MonthFirst(DataColumns& c) {
  c.options.date_order = DataFileOptions::DateOrder::kMonthFirst;
}

inline Change From(const std::string& quantity, const std::string& from,
                   const std::string& unit = "") {
  return [=](DataColumns& c) { c.sources[quantity] = {from, unit}; };
}

inline Change Delimiter(char delimiter) {
  return [delimiter](DataColumns& c) { c.options.delimiter = delimiter; };
}

inline Change TimeColumn(const std::string& name) {
  return [name](DataColumns& c) { c.options.time_column = name; };
}

inline Change Streamed(const std::string& name) {
  return [name](DataColumns& c) {
    c.measured = {"x"};
    c.streamed = {name};
  };
}

// A file that is read.
struct ReadCase {
  const char* name;
  std::string text;
  std::string values;
  std::string found;  // after "d.csv: "; empty: nothing is said
  Change change = nullptr;

  friend std::ostream& operator<<(std::ostream& out, const ReadCase& file) {
    return out << '"' << file.text << '"';
  }
};

// A file that is refused.
struct RefusedCase {
  const char* name;
  std::string text;
  std::string start;                // the file and the line
  std::vector<std::string> pieces;  // what else the message has
  Change change = nullptr;

  friend std::ostream& operator<<(std::ostream& out, const RefusedCase& file) {
    return out << '"' << file.text << '"';
  }
};

}  // namespace polyest::internal
