#include "client/cpp/data/row_clock.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>
#include <utility>

#include "client/cpp/data/cells.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

using TimeZero = DataFileOptions::TimeZero;

constexpr double kNanosecondsPerSecond = 1e9;
constexpr double kHalfADay_s = 43'200;

// Times of 1.8e9 s that differ by microseconds must differ in a message, too.
std::string Text(double time_s) { return absl::StrFormat("%.15g", time_s); }

DateOrder OrderOf(DataFileOptions::DateOrder order) {
  switch (order) {
    case DataFileOptions::DateOrder::kAutomatic:
      return DateOrder::kUnknown;
    case DataFileOptions::DateOrder::kDayFirst:
      return DateOrder::kDayFirst;
    case DataFileOptions::DateOrder::kMonthFirst:
      return DateOrder::kMonthFirst;
  }
  return DateOrder::kUnknown;
}

}  // namespace

RowClock::RowClock(const DataFileOptions& options, const DataColumn& column)
    : options_(options), column_(column), order_(OrderOf(options.date_order)) {}

absl::Status RowClock::Read(absl::string_view text, CellTime& time) {
  const ClockTime read = ReadClockTime(text, order_);
  time.nanoseconds = read.nanoseconds;
  time.has_zone = read.has_zone;
  time.form = read.kind == ClockTime::kDate ? CellTime::kDate : CellTime::kTimeOfDay;
  if (read.kind == ClockTime::kNone) {
    return absl::InvalidArgumentError(
        absl::StrCat(QuoteCell(text),
                     " must be a number, or a time such as 2026-01-31T13:00:00.5 or 13:00:00.5"));
  }
  if (read.kind == ClockTime::kTwoReadings) {
    const bool is_date = text.find_first_of("/-.") != text.npos;
    return absl::InvalidArgumentError(absl::StrCat(
        QuoteCell(text), is_date ? " may have the day or the month first; --date-order dmy or "
                                   "--date-order mdy decides"
                                 : " may be hours and minutes or minutes and seconds; it must have "
                                   "all three, hh:mm:ss"));
  }
  return absl::OkStatus();
}

absl::Status RowClock::Error(absl::string_view cell, double time_s, absl::string_view rule) const {
  if (column_.name.header == "t" && column_.conversion.IsIdentity() && !from_first_row_) {
    return absl::InvalidArgumentError(absl::StrCat(Text(time_s), " must be ", rule));
  }
  return absl::InvalidArgumentError(
      absl::StrCat(QuoteCell(cell), ", which is t = ", Text(time_s), " s, must be ", rule));
}

absl::Status RowClock::CheckForm(const CellTime& time) const {
  if (rows_ > 0 && time.form != first_.form) {
    return absl::InvalidArgumentError(absl::StrCat(
        "is written in another way than the time of the first row, ", QuoteCell(first_cell_)));
  }
  if (rows_ > 0 && time.has_zone != first_.has_zone) {
    return absl::InvalidArgumentError("either all times or none must name their zone");
  }
  if (time.form == CellTime::kNumber && !column_.unit_refusal.empty()) {
    return absl::InvalidArgumentError(column_.unit_refusal);
  }
  if (time.form == CellTime::kDate && options_.time_zero == TimeZero::kFile) {
    return absl::InvalidArgumentError(
        "is a date, and dates have no time 0 of their own; leave out --time-zero file");
  }
  return absl::OkStatus();
}

double RowClock::Seconds(const CellTime& time, const CellTime& zero) const {
  if (time.form == CellTime::kNumber) return column_.conversion(time.number - zero.number);
  return static_cast<double>(time.nanoseconds - zero.nanoseconds) / kNanosecondsPerSecond;
}

absl::Status RowClock::Next(const CellTime& time, int32_t run, absl::string_view cell) {
  POLYEST_RETURN_IF_ERROR(CheckForm(time));
  const bool from_first =
      options_.time_zero == TimeZero::kFirst ||
      (options_.time_zero == TimeZero::kAutomatic && time.form == CellTime::kDate);
  const bool begins = rows_ == 0 || run != run_;
  const CellTime& zero = from_first && begins ? time : zero_;
  const double time_s = Seconds(time, zero);
  if (!std::isfinite(time_s)) return Error(cell, time_s, "finite");
  if (time_s < 0) {
    return Error(cell, time_s, "≥ 0; --time-zero first lets the time begin at the first row");
  }
  if (!begins && time_s <= time_s_ && !options_.any_order) {
    const bool again = std::exchange(went_back_, true);
    const bool midnight = time.form == CellTime::kTimeOfDay && time_s_ - time_s > kHalfADay_s;
    return Error(cell, time_s,
                 absl::StrCat("later than ", Text(time_s_),
                              again ? ", where the time went back" : " of the row before",
                              midnight           ? "; a record that passes midnight needs dates"
                              : time_s < time_s_ ? "; a new run needs a column run that changes"
                                                 : ""));
  }
  if (rows_ == 0) {
    first_ = time;
    first_cell_ = std::string(cell);
    first_time_s_ = time_s;
  }
  from_first_row_ = from_first;
  if (from_first && begins) zero_ = time;
  time_s_ = time_s;
  went_back_ = false;
  run_ = run;
  ++rows_;
  return absl::OkStatus();
}

}  // namespace polyest::internal
