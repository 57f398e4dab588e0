#include "polyest/data_file.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include "client/cpp/file_kind.h"
#include "core/common/check.h"
#include "core/common/status.h"

namespace polyest {

using namespace internal;

namespace {

// Longer lines are refused, so that a file without line ends is not read into memory whole.
constexpr std::streamsize kMaxLineBytes = 1 << 16;

// Quotes a cell for a message; a long one is cut.
std::string Quoted(absl::string_view cell) {
  constexpr size_t kMaxShown = 40;
  return absl::StrCat("\"", cell.substr(0, kMaxShown), cell.size() > kMaxShown ? "…" : "", "\"");
}

bool Contains(const std::vector<std::string>& names, absl::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string KnownColumns(const DataColumns& known) {
  std::vector<std::string> names = {"t", "run"};
  names.insert(names.end(), known.measured.begin(), known.measured.end());
  names.insert(names.end(), known.streamed.begin(), known.streamed.end());
  return absl::StrJoin(names, ", ");
}

}  // namespace

DataColumns ColumnsOf(const v1::Problem& problem) {
  DataColumns columns;
  for (const v1::MeasuredOutput& measured : problem.measured()) {
    columns.measured.push_back(measured.output());
  }
  for (const v1::Input& input : problem.inputs()) {
    if (input.has_streamed()) columns.streamed.push_back(input.name());
  }
  return columns;
}

DataReader::DataReader(std::istream& in, std::string name)
    : in_(&in), name_(std::move(name)), buffer_(std::make_unique<char[]>(kMaxLineBytes)) {}

absl::Status DataReader::LineError(absl::string_view message) const {
  return absl::InvalidArgumentError(absl::StrCat(name_, ":", line_, ": ", message));
}

// Reads the next line that is not blank; false at the end of the data.
absl::StatusOr<bool> DataReader::NextLine(absl::string_view& line) {
  do {
    in_->getline(buffer_.get(), kMaxLineBytes);
    const std::streamsize count = in_->gcount();
    if (in_->bad()) return absl::InvalidArgumentError(absl::StrCat(name_, ": cannot be read"));
    if (in_->eof() && count == 0) return false;
    ++line_;
    if (in_->fail() && !in_->eof()) {
      return LineError(absl::StrCat("the line is longer than ", kMaxLineBytes - 1, " bytes"));
    }
    // gcount includes the line end, which is not in the buffer.
    line = absl::string_view(buffer_.get(), static_cast<size_t>(in_->eof() ? count : count - 1));
    if (line_ == 1 && absl::StartsWith(line, "\xEF\xBB\xBF")) line.remove_prefix(3);
    line = absl::StripAsciiWhitespace(line);
  } while (line.empty());
  return true;
}

absl::StatusOr<DataReader> DataReader::Open(std::istream& in, std::string name,
                                            const DataColumns& columns, RefusedLine refused) {
  DataReader reader(in, std::move(name));
  absl::string_view header;
  POLYEST_ASSIGN_OR_RETURN(const bool found, reader.NextLine(header));
  if (!found) {
    return absl::InvalidArgumentError(
        absl::StrCat(reader.name_, ": is empty; the first line must name the columns, t first"));
  }
  if (KindOfText(header) == FileKind::kJson) {
    return absl::InvalidArgumentError(absl::StrCat(
        reader.name_, ": is JSON; data are CSV, and the first line names the columns, t first"));
  }
  for (const absl::string_view cell : absl::StrSplit(header, ',')) {
    const absl::string_view column = absl::StripAsciiWhitespace(cell);
    absl::Status added = reader.AddColumn(column, columns);
    if (added.ok()) continue;
    // Without a time column, no row can be read.
    if (reader.columns_.empty()) return added;
    POLYEST_RETURN_IF_ERROR(refused(std::move(added)));
    reader.columns_.push_back({std::string(column), Role::kRefused, -1});
  }
  POLYEST_RETURN_IF_ERROR(reader.CheckStreamed(columns, refused));
  return reader;
}

absl::Status DataReader::AddColumn(absl::string_view name, const DataColumns& known) {
  if (columns_.empty() && name != "t") {
    return LineError(absl::StrCat("the first column is ", Quoted(name),
                                  "; the first line must name the columns, t first"));
  }
  for (const Column& column : columns_) {
    if (column.name == name) {
      return LineError(absl::StrCat("the column ", Quoted(name), " is named twice"));
    }
  }
  Column column{std::string(name), Role::kTime, -1};
  if (name == "t") {
    // The column has the role kTime already.
  } else if (Contains(known.measured, name)) {
    column.role = Role::kMeasured;
    column.channel = channels_++;
  } else if (Contains(known.streamed, name)) {
    column.role = Role::kStreamed;
    column.channel = channels_++;
  } else if (name == "run") {
    column.role = Role::kRun;
    has_run_ = true;
  } else {
    return LineError(absl::StrCat("unknown column ", Quoted(name), "; the problem's columns are ",
                                  KnownColumns(known)));
  }
  columns_.push_back(std::move(column));
  return absl::OkStatus();
}

absl::Status DataReader::CheckStreamed(const DataColumns& known, RefusedLine refused) const {
  for (const std::string& name : known.streamed) {
    const bool found = std::any_of(columns_.begin(), columns_.end(),
                                   [&](const Column& column) { return column.name == name; });
    if (!found) {
      POLYEST_RETURN_IF_ERROR(refused(LineError(absl::StrCat(
          "the column ", Quoted(name), " for the streamed input of that name is missing"))));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::Measurements> DataReader::Read(int64_t max_rows, RefusedLine refused) {
  POLYEST_CHECK(max_rows > 0);
  max_rows = std::min<int64_t>(max_rows, std::numeric_limits<int32_t>::max());
  v1::Measurements batch;
  absl::string_view line;
  while (batch.time_s_size() < max_rows) {
    POLYEST_ASSIGN_OR_RETURN(const bool found, NextLine(line));
    if (!found) break;
    if (batch.channels_size() == 0) {
      for (const Column& column : columns_) {
        if (column.channel >= 0) batch.add_channels()->set_name(column.name);
      }
    }
    absl::Status parsed = ParseRow(line, batch);
    if (parsed.ok()) {
      ++rows_;
    } else {
      any_refused_ = true;
      POLYEST_RETURN_IF_ERROR(refused(std::move(parsed)));
    }
  }
  if (rows_ == 0 && !any_refused_) {
    return absl::InvalidArgumentError(absl::StrCat(name_, ": has no rows below its header"));
  }
  return batch;
}

// Adds a row to the batch. On an error, the batch and the present time and run stay unchanged.
absl::Status DataReader::ParseRow(absl::string_view line, v1::Measurements& batch) {
  const int32_t previous_run = run_;
  previous_time_s_ = time_s_;
  absl::Status parsed = ParseCells(line, batch);
  if (parsed.ok()) parsed = CheckTime(previous_run);
  if (!parsed.ok()) {
    time_s_ = previous_time_s_;
    run_ = previous_run;
    const int rows = batch.time_s_size();
    for (v1::Measurements::Channel& channel : *batch.mutable_channels()) {
      if (channel.values_size() > rows) channel.mutable_values()->Truncate(rows);
      if (!channel.missing().empty() && *channel.missing().rbegin() == rows) {
        channel.mutable_missing()->RemoveLast();
      }
    }
    return parsed;
  }
  batch.add_time_s(time_s_);
  if (has_run_) batch.add_run(run_);
  return absl::OkStatus();
}

absl::Status DataReader::ParseCells(absl::string_view line, v1::Measurements& batch) {
  const auto cells = 1 + std::count(line.begin(), line.end(), ',');
  if (static_cast<size_t>(cells) != columns_.size()) {
    return LineError(
        absl::StrCat("the row has ", cells, " cells, the header has ", columns_.size()));
  }
  for (const Column& column : columns_) {
    const size_t end = std::min(line.find(','), line.size());
    POLYEST_RETURN_IF_ERROR(
        ParseCell(column, absl::StripAsciiWhitespace(line.substr(0, end)), batch));
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return absl::OkStatus();
}

absl::Status DataReader::ParseCell(const Column& column, absl::string_view cell,
                                   v1::Measurements& batch) {
  if (column.role == Role::kRefused) return absl::OkStatus();
  if (column.role == Role::kRun) return ParseRun(cell);
  if (column.role == Role::kMeasured && cell.empty()) {
    v1::Measurements::Channel& channel = *batch.mutable_channels(column.channel);
    channel.add_missing(channel.values_size());
    channel.add_values(0);
    return absl::OkStatus();
  }
  POLYEST_ASSIGN_OR_RETURN(const double value, ParseNumber(column, cell));
  if (column.role == Role::kTime) {
    time_s_ = value;
  } else {
    batch.mutable_channels(column.channel)->add_values(value);
  }
  return absl::OkStatus();
}

absl::Status DataReader::ParseRun(absl::string_view cell) {
  int32_t run = -1;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), run);
  if (error != std::errc() || end != cell.data() + cell.size() || run < 0) {
    return LineError(absl::StrCat("column run: ", Quoted(cell), " must be a whole number ≥ 0"));
  }
  if (rows_ == 0 && run != 0) {
    return LineError(absl::StrCat("column run: the first row's run is ", run, ", it must be 0"));
  }
  if (run < run_) {
    return LineError(absl::StrCat("column run: ", run, " after ", run_, "; it must not decrease"));
  }
  run_ = run;
  return absl::OkStatus();
}

absl::Status DataReader::CheckTime(int64_t previous_run) const {
  if (time_s_ < 0) return LineError(absl::StrCat("column t: ", time_s_, " must be ≥ 0"));
  if (rows_ > 0 && run_ == previous_run && time_s_ <= previous_time_s_) {
    return LineError(absl::StrCat("column t: ", time_s_, " must be later than ", previous_time_s_,
                                  " of the row before"));
  }
  return absl::OkStatus();
}

absl::StatusOr<double> DataReader::ParseNumber(const Column& column, absl::string_view cell) const {
  if (cell.empty()) {
    return LineError(absl::StrCat("column ", column.name, ": a value is missing; ",
                                  column.role == Role::kTime
                                      ? "every row needs its time"
                                      : "a streamed input needs a value in every row"));
  }
  absl::string_view digits = cell;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::result_out_of_range) {
    return LineError(absl::StrCat("column ", column.name, ": ", Quoted(cell),
                                  " is out of the range of a double"));
  }
  if (error != std::errc() || end != digits.data() + digits.size()) {
    return LineError(absl::StrCat("column ", column.name, ": ", Quoted(cell), " must be a number"));
  }
  if (!std::isfinite(value)) {
    return LineError(absl::StrCat("column ", column.name, ": ", Quoted(cell),
                                  " must be finite; leave the cell of a missing sample empty"));
  }
  return value;
}

absl::StatusOr<v1::Measurements> ReadDataFile(const std::string& path, const DataColumns& columns,
                                              RefusedLine refused) {
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": cannot be opened: ", std::strerror(errno)));
  }
  POLYEST_ASSIGN_OR_RETURN(DataReader reader, DataReader::Open(in, path, columns, refused));
  return reader.Read(std::numeric_limits<int64_t>::max(), refused);
}

}  // namespace polyest
