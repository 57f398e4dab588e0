#include "polyest/data_file.h"

#include <absl/algorithm/container.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include "client/cpp/data/cells.h"
#include "client/cpp/data/column_map.h"
#include "client/cpp/data/column_units.h"
#include "client/cpp/data/found_text.h"
#include "client/cpp/data/header.h"
#include "client/cpp/data/row_parser.h"
#include "client/cpp/data/text_lines.h"
#include "client/cpp/file_kind.h"
#include "core/common/check.h"
#include "core/common/status.h"
#include "core/model/equations/parser.h"

namespace polyest {

using namespace internal;

namespace {

// Returns the names in `useWhen` that are no other columns. One that cannot be read has none: the
// problem is refused elsewhere.
std::vector<std::string> ConditionColumns(const v1::Problem& problem, const DataColumns& others) {
  if (problem.use_when().empty()) return {};
  const auto syntax = equations::Parse(FieldPath("useWhen"), problem.use_when(), {});
  if (!syntax.ok()) return {};
  std::vector<std::string> names = equations::VariablesIn(*syntax);
  std::erase_if(names, [&](const std::string& name) {
    return name == "t" || absl::c_linear_search(others.measured, name) ||
           absl::c_linear_search(others.streamed, name);
  });
  return names;
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
  columns.conditions = ConditionColumns(problem, columns);
  for (const auto& [quantity, column] : problem.columns()) {
    columns.sources[quantity] = {column.from(), column.unit()};
  }
  return columns;
}

void RowLines::Add(int64_t line) {
  if (rows_ == 0 || line != LineOf(rows_ - 1) + 1) {
    constexpr size_t kMaxPieces = 65'536;
    if (pieces_.size() == kMaxPieces) {
      pieces_.erase(pieces_.begin(), pieces_.begin() + kMaxPieces / 2);
    }
    pieces_.push_back({rows_, line});
  }
  ++rows_;
}

int64_t RowLines::LineOf(int64_t row) const {
  if (row < 0 || row >= rows_ || row < pieces_.front().first_row) return 0;
  const auto after = std::ranges::upper_bound(pieces_, row, {}, &Piece::first_row);
  const Piece& piece = *std::prev(after);
  return piece.first_line + row - piece.first_row;
}

class DataReader::Reader {
 public:
  Reader(std::istream& in, std::string name, DataColumns known)
      : known_(std::move(known)), lines_(in, std::move(name)) {}

  absl::Status Open(RefusedLine refused) {
    POLYEST_ASSIGN_OR_RETURN(header_, FindHeader(lines_, known_));
    POLYEST_ASSIGN_OR_RETURN(columns_, MapColumns(header_, known_, lines_, refused));
    return absl::OkStatus();
  }

  absl::Status Read(int64_t max_rows, v1::Measurements& batch, RefusedLine refused);

  const RowLines& Lines() const { return row_lines_; }

  bool CountsFromFirstRow() const { return rows_ && rows_->clock().from_first_row(); }

  std::string Found() const {
    if (!rows_) return "";
    const std::string text = FoundText({header_, *rows_, lines_.encoding(), units_line_, ended_});
    return text.empty() ? "" : absl::StrCat(lines_.name(), ": ", text);
  }

  std::string UnendedLine() const {
    if (unended_line_ == 0) return "";
    return absl::StrCat(
        lines_.name(), ":", unended_line_, ": the last line has no end",
        known_.options.whole_lines ? " and is left out" : "; its last value may be cut off");
  }

 private:
  absl::StatusOr<bool> NextLine(absl::string_view& line);
  bool LeavesOut();
  absl::Status Start(absl::string_view& line, bool& found, RefusedLine refused);
  void AddChannels(v1::Measurements& batch);
  void AddRow(v1::Measurements& batch);

  const DataColumns known_;
  TextLines lines_;
  Header header_;
  std::vector<DataColumn> columns_;
  std::optional<RowParser> rows_;  // none before the first line below the header is read
  int64_t units_line_ = 0;
  int64_t unended_line_ = 0;  // number of the last line if it has no end
  RowLines row_lines_;
  bool has_run_ = false;
  bool any_refused_ = false;
  bool ended_ = false;                                // whether all rows have been read
  std::vector<v1::Measurements::Channel*> channels_;  // of the batch being read
};

// Reads the next line that is neither blank nor a comment; false at the end of the data.
absl::StatusOr<bool> DataReader::Reader::NextLine(absl::string_view& line) {
  do {
    POLYEST_ASSIGN_OR_RETURN(const bool found, lines_.Next(line));
    if (!found) return false;
  } while (IsLeftOut(line));
  return true;
}

// Whether the last line read, a row, is left out because it has no end.
bool DataReader::Reader::LeavesOut() {
  if (lines_.cut_off()) unended_line_ = lines_.line();
  return lines_.cut_off() && known_.options.whole_lines;
}

// Reads the line below the header, which may be a row of units, and prepares for the rows. Sets
// `line` to the first row, if one is `found`.
absl::Status DataReader::Reader::Start(absl::string_view& line, bool& found, RefusedLine refused) {
  std::vector<std::string> units;
  if (found) units = SplitCells(line, header_.delimiter);
  if (found && IsUnitsRow(units, columns_)) {
    units_line_ = lines_.line();
    POLYEST_ASSIGN_OR_RETURN(found, NextLine(line));
  } else {
    units.clear();
  }
  POLYEST_RETURN_IF_ERROR(ResolveUnits(known_, units, units_line_ > 0 ? units_line_ : header_.line,
                                       lines_, refused, columns_));
  has_run_ = std::any_of(columns_.begin(), columns_.end(),
                         [](const DataColumn& column) { return column.role == DataColumn::kRun; });
  any_refused_ = any_refused_ || std::any_of(columns_.begin(), columns_.end(), [](const auto& c) {
                   return c.role == DataColumn::kRefused;
                 });
  rows_.emplace(columns_, header_.delimiter, known_.options, lines_);
  return absl::OkStatus();
}

void DataReader::Reader::AddChannels(v1::Measurements& batch) {
  channels_.clear();
  for (const DataColumn& column : columns_) {
    if (!column.is_channel()) continue;
    channels_.push_back(batch.add_channels());
    channels_.back()->set_name(column.quantity);
  }
}

void DataReader::Reader::AddRow(v1::Measurements& batch) {
  const Row& row = rows_->row();
  for (size_t i = 0; i < channels_.size(); ++i) {
    channels_[i]->mutable_values()->Add(row.values[i]);
    if (row.any_missing && row.missing[i] != 0) channels_[i]->add_missing(batch.time_s_size());
  }
  batch.mutable_time_s()->Add(rows_->clock().time_s());
  if (has_run_) batch.add_run(rows_->clock().run());
  row_lines_.Add(lines_.line());
}

absl::Status DataReader::Reader::Read(int64_t max_rows, v1::Measurements& batch,
                                      RefusedLine refused) {
  batch.Clear();
  absl::string_view line;
  while (batch.time_s_size() < max_rows) {
    POLYEST_ASSIGN_OR_RETURN(bool found, NextLine(line));
    if (!rows_) POLYEST_RETURN_IF_ERROR(Start(line, found, refused));
    if (!found || LeavesOut()) {
      ended_ = true;
      break;
    }
    if (batch.channels_size() == 0) AddChannels(batch);
    absl::Status parsed = rows_->Parse(line);
    if (parsed.ok()) {
      AddRow(batch);
    } else {
      any_refused_ = true;
      POLYEST_RETURN_IF_ERROR(refused(std::move(parsed)));
    }
  }
  if (rows_->clock().rows() == 0 && !any_refused_) {
    return absl::InvalidArgumentError(
        absl::StrCat(lines_.name(), ": has no rows below its header",
                     unended_line_ > 0 ? " but one that has no end" : ""));
  }
  return absl::OkStatus();
}

DataReader::DataReader(std::unique_ptr<Reader> reader) : reader_(std::move(reader)) {}
DataReader::DataReader(DataReader&& other) noexcept = default;
DataReader& DataReader::operator=(DataReader&& other) noexcept = default;
DataReader::~DataReader() = default;

absl::StatusOr<DataReader> DataReader::Open(std::istream& in, std::string name,
                                            const DataColumns& columns, RefusedLine refused) {
  auto reader = std::make_unique<Reader>(in, std::move(name), columns);
  POLYEST_RETURN_IF_ERROR(reader->Open(refused));
  return DataReader(std::move(reader));
}

absl::StatusOr<v1::Measurements> DataReader::Read(int64_t max_rows, RefusedLine refused) {
  v1::Measurements batch;
  POLYEST_RETURN_IF_ERROR(Read(max_rows, batch, refused));
  return batch;
}

absl::Status DataReader::Read(int64_t max_rows, v1::Measurements& batch, RefusedLine refused) {
  POLYEST_CHECK(max_rows > 0);
  return reader_->Read(std::min<int64_t>(max_rows, std::numeric_limits<int32_t>::max()), batch,
                       refused);
}

std::string DataReader::Found() const { return reader_->Found(); }

std::string DataReader::UnendedLine() const { return reader_->UnendedLine(); }

const RowLines& DataReader::Lines() const { return reader_->Lines(); }

bool DataReader::CountsFromFirstRow() const { return reader_->CountsFromFirstRow(); }

absl::StatusOr<v1::Measurements> ReadDataFile(const std::string& path, const DataColumns& columns,
                                              RefusedLine refused, std::string* found,
                                              RowLines* lines) {
  POLYEST_RETURN_IF_ERROR(CheckIsNoFolder(path));
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": cannot be opened: ", std::strerror(errno)));
  }
  POLYEST_ASSIGN_OR_RETURN(DataReader reader, DataReader::Open(in, path, columns, refused));
  auto data = reader.Read(std::numeric_limits<int64_t>::max(), refused);
  if (found != nullptr) {
    *found = reader.Found();
    const std::string unended = reader.UnendedLine();
    absl::StrAppend(found, found->empty() || unended.empty() ? "" : "\n", unended);
  }
  if (lines != nullptr) *lines = reader.Lines();
  return data;
}

}  // namespace polyest
