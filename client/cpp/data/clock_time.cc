#include "client/cpp/data/clock_time.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <chrono>

namespace polyest::internal {
namespace {

constexpr int64_t kSecond = 1'000'000'000;  // ns

bool IsDigitOfTime(char c) { return absl::ascii_isdigit(static_cast<unsigned char>(c)); }

// Takes `least` to `most` digits from the beginning.
bool TakeNumber(absl::string_view& text, size_t least, size_t most, int& number) {
  size_t count = 0;
  number = 0;
  while (count < text.size() && IsDigitOfTime(text[count])) {
    if (count == most) return false;
    number = 10 * number + (text[count++] - '0');
  }
  text.remove_prefix(count);
  return count >= least;
}

// Takes a fraction of a second, in ns.
int64_t TakeFraction(absl::string_view& text) {
  int64_t fraction = 0;
  int64_t unit = kSecond / 10;
  while (!text.empty() && IsDigitOfTime(text[0])) {
    fraction += unit * (text[0] - '0');
    unit /= 10;
    text.remove_prefix(1);
  }
  return fraction;
}

// Takes "h:mm:ss.fff"; false if it is not one. `has_seconds` is false for two numbers only.
bool TakeTimeOfDay(absl::string_view& text, int64_t& nanoseconds, bool& has_seconds) {
  int hours = 0, minutes = 0, seconds = 0;
  if (!TakeNumber(text, 1, 2, hours) || !absl::ConsumePrefix(&text, ":")) return false;
  if (!TakeNumber(text, 2, 2, minutes)) return false;
  has_seconds = absl::ConsumePrefix(&text, ":");
  if (has_seconds && !TakeNumber(text, 2, 2, seconds)) return false;
  if (hours > 23 || minutes > 59 || seconds > 59) return false;
  nanoseconds = kSecond * (3600 * hours + 60 * minutes + seconds);
  if (has_seconds && (absl::ConsumePrefix(&text, ".") || absl::ConsumePrefix(&text, ","))) {
    if (text.empty() || !IsDigitOfTime(text[0])) return false;
    nanoseconds += TakeFraction(text);
  }
  return true;
}

// Takes "AM" or "PM" and shifts a time of 12 hours; false if the time is none.
bool TakeHalfOfDay(absl::string_view& text, int64_t& nanoseconds) {
  constexpr int64_t kHalf = 12 * 3600 * kSecond;
  const absl::string_view word = absl::StripLeadingAsciiWhitespace(text);
  const bool pm = absl::StartsWithIgnoreCase(word, "PM");
  if (!pm && !absl::StartsWithIgnoreCase(word, "AM")) return true;
  text = word.substr(2);
  if (nanoseconds < kHalf / 12 || nanoseconds >= kHalf / 12 * 13) return false;
  nanoseconds = nanoseconds % kHalf + (pm ? kHalf : 0);
  return true;
}

// Takes "Z" or "+01:00" and makes the time one of UTC; false for what is no zone.
bool TakeZone(absl::string_view& text, ClockTime& time) {
  if (text.empty()) return true;
  time.has_zone = true;
  if (absl::ConsumePrefix(&text, "Z") || absl::ConsumePrefix(&text, "z")) return true;
  const int sign = text[0] == '+' ? 1 : -1;
  if (!absl::ConsumePrefix(&text, "+") && !absl::ConsumePrefix(&text, "-")) return false;
  int hours = 0, minutes = 0;
  if (text.size() == 4) {
    if (!TakeNumber(text, 4, 4, hours)) return false;
    minutes = hours % 100;
    hours /= 100;
  } else {
    if (!TakeNumber(text, 2, 2, hours)) return false;
    if (absl::ConsumePrefix(&text, ":") && !TakeNumber(text, 2, 2, minutes)) return false;
  }
  time.nanoseconds -= sign * kSecond * (3600 * hours + 60 * minutes);
  return hours <= 14 && minutes <= 59;
}

struct Date {
  int year = 0, month = 0, day = 0;
  bool two_readings = false;
};

// Decides which of the first two numbers of a date is the day.
void Order(int first, int second, DateOrder& order, Date& date) {
  DateOrder found = order;
  if (order == DateOrder::kUnknown && first > 12) found = DateOrder::kDayFirst;
  if (order == DateOrder::kUnknown && second > 12) found = DateOrder::kMonthFirst;
  date.two_readings = found == DateOrder::kUnknown && first != second;
  order = found;
  date.day = found == DateOrder::kMonthFirst ? second : first;
  date.month = found == DateOrder::kMonthFirst ? first : second;
}

bool TakeDate(absl::string_view& text, DateOrder& order, Date& date) {
  int first = 0, second = 0, third = 0;
  const size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  if (!TakeNumber(text, 1, 4, first) || text.empty()) return false;
  const char mark = text[0];
  if (mark != '-' && mark != '/' && mark != '.') return false;
  const absl::string_view separator(&mark, 1);
  if (!absl::ConsumePrefix(&text, separator) || !TakeNumber(text, 1, 2, second)) return false;
  if (!absl::ConsumePrefix(&text, separator)) return false;
  if (!TakeNumber(text, 1, 4, third)) return false;
  const bool year_first = digits == 4 && third <= 31;
  if (year_first) {
    date = {first, second, third};
  } else if (digits <= 2 && third >= 1000) {
    date.year = third;
    DateOrder day_first = DateOrder::kDayFirst;  // a date with points is always so
    Order(first, second, mark == '.' ? day_first : order, date);
  } else {
    return false;
  }
  return true;
}

// Returns the days since 1970-01-01, or nothing for a day that is not in the calendar.
std::optional<int64_t> DaysOf(const Date& date) {
  const std::chrono::year_month_day day{std::chrono::year(date.year),
                                        std::chrono::month(static_cast<unsigned>(date.month)),
                                        std::chrono::day(static_cast<unsigned>(date.day))};
  // 2262 is the last year whose nanoseconds fit.
  if (!day.ok() || date.year < 1700 || date.year > 2261) return std::nullopt;
  return std::chrono::sys_days(day).time_since_epoch().count();
}

ClockTime ReadTimeOfDay(absl::string_view text) {
  ClockTime time;
  bool has_seconds = false;
  if (!TakeTimeOfDay(text, time.nanoseconds, has_seconds)) return {};
  if (!TakeHalfOfDay(text, time.nanoseconds) || !text.empty()) return {};
  time.kind = has_seconds ? ClockTime::kTimeOfDay : ClockTime::kTwoReadings;
  return time;
}

}  // namespace

ClockTime ReadClockTime(absl::string_view text, DateOrder& order) {
  const size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  if (digits == 0 || digits > 4 || digits == text.size()) return {};
  if (text[digits] == ':') return ReadTimeOfDay(text);
  ClockTime time;
  Date date;
  DateOrder date_order = order;
  if (!TakeDate(text, date_order, date)) return {};
  const std::optional<int64_t> days = DaysOf(date);
  if (!days && !date.two_readings) return {};
  if (!text.empty()) {
    if (!absl::ConsumePrefix(&text, "T") && !absl::ConsumePrefix(&text, " ")) return {};
    text = absl::StripLeadingAsciiWhitespace(text);
    bool has_seconds = false;
    if (!TakeTimeOfDay(text, time.nanoseconds, has_seconds)) return {};
    if (!TakeHalfOfDay(text, time.nanoseconds)) return {};
    if (!TakeZone(text, time) || !text.empty()) return {};
  }
  time.kind = date.two_readings ? ClockTime::kTwoReadings : ClockTime::kDate;
  time.nanoseconds += days.value_or(0) * 24 * 3600 * kSecond;
  order = date_order;
  return time;
}

}  // namespace polyest::internal
