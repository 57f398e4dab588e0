#include "client/cpp/data/header.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "client/cpp/data/cells.h"
#include "client/cpp/data/clock_time.h"
#include "client/cpp/data/number_cell.h"
#include "client/cpp/file_kind.h"
#include "core/common/status.h"
#include "core/common/utf8.h"

namespace polyest::internal {
namespace {

constexpr char kDelimiters[] = {',', ';', '\t', '|'};
// Where a header must have begun.
constexpr size_t kMaxAbove = 1 << 16;  // bytes
// A quoted header may have line ends in it.
constexpr int kMaxHeaderLines = 8;

// Beginnings of files that are often taken for CSV.
constexpr std::pair<absl::string_view, absl::string_view> kBinaries[] = {
    {"PK\x03\x04", "an Excel workbook or a ZIP file"},
    {"\xD0\xCF\x11\xE0", "an Excel workbook"},
    {"MDF ", "an MDF file"},
    {"UnFinMF", "an MDF file"},
    {"\x89HDF", "an HDF5 file"},
    {"MATLAB 5.0", "a MATLAB file"},
    {"TDSm", "a TDMS file"},
    {"\x1F\x8B", "a compressed file"},
    {"PAR1", "a Parquet file"}};

// What spreadsheets write into a cell without a value, in English and German.
constexpr absl::string_view kCellErrors[] = {"#N/A",  "#NV",   "#DIV/0!", "#VALUE!", "#WERT!",
                                             "#REF!", "#NUM!", "#ZAHL!",  "#BEZUG!", "#NAME?"};

// Returns what a line that is not text is the beginning of; nothing for text.
std::optional<std::string> BinaryKind(absl::string_view line) {
  for (const auto& [beginning, kind] : kBinaries) {
    if (absl::StartsWith(line, beginning)) return std::string(kind);
  }
  const bool control = std::any_of(line.begin(), line.end(), [](char c) {
    return static_cast<unsigned char>(c) < ' ' && c != '\t' && c != '\f' && c != '\v';
  });
  return control ? std::optional<std::string>("a binary file") : std::nullopt;
}

// Whether a line is a comment. A spreadsheet's #N/A or #DIV/0! begins a row.
bool IsComment(absl::string_view line) {
  if (line[0] != '#') return false;
  return std::none_of(std::begin(kCellErrors), std::end(kCellErrors),
                      [line](auto error) { return absl::StartsWithIgnoreCase(line, error); });
}

// What a line says as a header.
struct Candidate {
  Header header;
  bool has_time = false;
  int quantities = 0;

  int Score() const { return (has_time ? 1 : 0) + quantities; }
  bool IsBetterThan(const Candidate& other) const {
    if (Score() != other.Score()) return Score() > other.Score();
    return header.names.size() > other.header.names.size();
  }
};

Candidate Split(absl::string_view line, char delimiter, const DataColumns& columns) {
  Candidate candidate;
  candidate.header.delimiter = delimiter;
  for (const std::string& cell : SplitCells(line, delimiter)) {
    candidate.header.names.push_back(ParseColumnName(cell));
  }
  const auto& names = candidate.header.names;
  candidate.has_time = std::any_of(
      names.begin(), names.end(), [&](const ColumnName& name) { return MayBeTime(name, columns); });
  for (const auto* const quantities : {&columns.measured, &columns.streamed, &columns.conditions}) {
    for (const std::string& quantity : *quantities) {
      candidate.quantities += std::any_of(names.begin(), names.end(), [&](const ColumnName& name) {
        return IsColumnOf(name, quantity, columns);
      });
    }
  }
  return candidate;
}

Candidate Split(absl::string_view line, const DataColumns& columns) {
  if (columns.options.delimiter != 0) return Split(line, columns.options.delimiter, columns);
  Candidate best = Split(line, kDelimiters[0], columns);
  for (const char delimiter : kDelimiters) {
    Candidate candidate = Split(line, delimiter, columns);
    if (candidate.IsBetterThan(best)) best = std::move(candidate);
  }
  return best;
}

bool IsValue(const ColumnName& cell) {
  DateOrder order = DateOrder::kDayFirst;
  return ReadNumberCell(cell.header, {'.', true}).kind == NumberCell::kNumber ||
         ReadNumberCell(cell.header, {',', true}).kind == NumberCell::kNumber ||
         ReadClockTime(cell.header, order).kind != ClockTime::kNone;
}

// Whether a line is a row of data: it has a number, and all its cells are numbers or missing.
bool IsRow(const Candidate& candidate) {
  const auto& cells = candidate.header.names;
  return std::any_of(cells.begin(), cells.end(), IsValue) &&
         std::all_of(cells.begin(), cells.end(), [](const ColumnName& cell) {
           return IsMissingWord(cell.header) || IsValue(cell);
         });
}

class Search {
 public:
  Search(TextLines& lines, const DataColumns& columns) : lines_(lines), columns_(columns) {}

  absl::StatusOr<Header> Run() {
    absl::string_view line;
    while (bytes_ <= kMaxAbove) {
      POLYEST_ASSIGN_OR_RETURN(const bool found, lines_.Next(line));
      if (!found) break;
      POLYEST_RETURN_IF_ERROR(CheckText(line));
      bytes_ += line.size();
      first_ = false;
      if (StripCell(line).empty()) continue;
      if (IsComment(StripCell(line))) {
        comment_ = std::string(StripCell(StripCell(line).substr(1)));
        comment_line_ = lines_.line();
        continue;
      }
      POLYEST_ASSIGN_OR_RETURN(const bool ends, Look(std::string(line)));
      if (ends) break;
    }
    if (!best_) return Empty();
    return std::move(best_->header);
  }

 private:
  absl::Status Empty() const {
    return absl::InvalidArgumentError(absl::StrCat(
        lines_.name(), ": is empty; the first line must name the columns, the time t and others"));
  }

  absl::Status CheckText(absl::string_view line) const {
    if (const auto kind = BinaryKind(line)) {
      return absl::InvalidArgumentError(
          absl::StrCat(lines_.name(), ": is not text but ", *kind, "; export its data as CSV"));
    }
    if (first_ && KindOfText(line) == FileKind::kJson && !absl::StartsWith(line, "[")) {
      return absl::InvalidArgumentError(absl::StrCat(
          lines_.name(), ": is JSON; data are CSV, and the first line names the columns"));
    }
    return absl::OkStatus();
  }

  // Appends further lines while a quote is open.
  absl::Status CloseQuotes(std::string& text) {
    for (int i = 0; i < kMaxHeaderLines; ++i) {
      if (std::count(text.begin(), text.end(), '"') % 2 == 0) break;
      absl::string_view line;
      POLYEST_ASSIGN_OR_RETURN(const bool found, lines_.Next(line));
      if (!found) break;
      absl::StrAppend(&text, " ", line);
    }
    return absl::OkStatus();
  }

  // Considers a line as the header; returns whether the search is at its end.
  absl::StatusOr<bool> Look(std::string text) {
    const int64_t number = lines_.line();
    POLYEST_RETURN_IF_ERROR(CloseQuotes(text));
    Candidate candidate = Split(text, columns_);
    candidate.header.windows = !IsUtf8(text);
    if (IsRow(candidate)) {
      TakeComment(candidate.header.names.size());
      if (best_) lines_.PutBack(std::move(text), number);
      if (!best_) Take(std::move(candidate), number);
      return true;
    }
    const bool any = columns_.measured.empty() && columns_.streamed.empty();
    const bool is_header = candidate.has_time && (any || candidate.quantities > 0);
    if (is_header || !best_ || (candidate.has_time && !best_->has_time)) {
      Take(std::move(candidate), number);
    }
    ++looked_at_;
    return is_header;
  }

  // Takes the last comment for the header if it names the columns of the row below it.
  void TakeComment(size_t cells) {
    Candidate candidate = Split(comment_, columns_);
    const bool names = candidate.has_time && candidate.header.names.size() == cells;
    if (!names || (best_ && best_->has_time)) return;
    Take(std::move(candidate), comment_line_);
    best_->header.in_comment = true;
  }

  void Take(Candidate candidate, int64_t line) {
    candidate.header.line = line;
    candidate.header.lines_above = looked_at_;
    best_ = std::move(candidate);
  }

  TextLines& lines_;
  const DataColumns& columns_;
  std::optional<Candidate> best_;
  std::string comment_;
  int64_t comment_line_ = 0;
  int looked_at_ = 0;
  size_t bytes_ = 0;
  bool first_ = true;
};

}  // namespace

bool IsLeftOut(absl::string_view line) {
  if (!line.empty() && line[0] > ' ' && line[0] != '#') return false;  // ASCII, as most lines
  const size_t first = line.find_first_not_of(" \t\f\v");
  if (first == absl::string_view::npos) return true;
  if (line[first] == '#') return IsComment(line.substr(first));
  return static_cast<unsigned char>(line[first]) >= 0x80 && StripCell(line).empty();
}

absl::StatusOr<Header> FindHeader(TextLines& lines, const DataColumns& columns) {
  return Search(lines, columns).Run();
}

}  // namespace polyest::internal
