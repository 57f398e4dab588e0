#pragma once

// Reads times of day and dates.

#include <absl/strings/string_view.h>

#include <cstdint>
#include <optional>

namespace polyest::internal {

// The order of day and month in dates such as 01/02/2026.
enum class DateOrder { kUnknown, kDayFirst, kMonthFirst };

struct ClockTime {
  enum Kind {
    kNone,         // the text is no time
    kTimeOfDay,    // hh:mm:ss with a fraction
    kDate,         // a date, with a time of day or without
    kTwoReadings,  // a date whose day may be its month; or hh:mm, which may be mm:ss
  };
  Kind kind = kNone;
  int64_t nanoseconds = 0;  // since midnight; of a date, since 1970-01-01 in its zone
  bool has_zone = false;    // the text names its zone, and the time is UTC
};

// Reads "2026-02-01T13:00:00.5", "2026-02-01 13:00:00,5Z", "…+01:00", "2026/02/01", "01.02.2026
// 13:00:00", "02/01/2026 1:00:00 PM", "13:00:00.5". Digits after the ninth of a fraction are left
// out. `order` says what 01/02/2026 is; a date that is possible in one order only sets it.
ClockTime ReadClockTime(absl::string_view text, DateOrder& order);

}  // namespace polyest::internal
