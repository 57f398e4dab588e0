#pragma once

// What a status says to programs beside its code: why, which limit was passed, and whether trying
// again later may help. It travels with the status and is not part of its message.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <chrono>
#include <optional>
#include <string>

namespace polyest::internal {

struct Refusal {
  bool operator==(const Refusal&) const = default;

  std::string reason;   // UPPER_SNAKE_CASE, one of those below
  std::string limit{};  // the option that sets it, "--max-sessions"; empty: none does
  // After which the same may be tried again; none: waiting does not help.
  std::optional<std::chrono::milliseconds> retry_delay{};
};

inline constexpr char kLimitExceeded[] = "LIMIT_EXCEEDED";
inline constexpr char kDiskFull[] = "DISK_FULL";
inline constexpr char kBusy[] = "BUSY";
inline constexpr char kOutOfMemory[] = "OUT_OF_MEMORY";
inline constexpr char kShuttingDown[] = "SHUTTING_DOWN";

// A status of this code, not OK, that says so.
absl::Status Refuse(absl::StatusCode code, absl::string_view message, const Refusal& refusal);
// RESOURCE_EXHAUSTED by a limit that waiting does not change.
absl::Status LimitExceeded(absl::string_view limit, absl::string_view message);
// None when it says nothing.
std::optional<Refusal> RefusalOf(const absl::Status& status);

}  // namespace polyest::internal
