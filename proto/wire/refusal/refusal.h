#pragma once

// Details of an error status for programs: its reason, the limit that was exceeded, and whether
// trying again later may help. They travel with the status and are not part of its message.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <chrono>
#include <optional>
#include <string>

namespace polyest::internal {

struct Refusal {
  bool operator==(const Refusal&) const = default;

  std::string reason;   // UPPER_SNAKE_CASE, one of those below
  std::string limit{};  // the option that sets the limit, "--max-sessions"; empty: no option does
  // Time after which the request may be tried again; none: waiting does not help.
  std::optional<std::chrono::milliseconds> retry_delay{};
  // Address of the daemon that serves the session at present, HOST:PORT; empty: not known.
  std::string owner{};
};

inline constexpr char kLimitExceeded[] = "LIMIT_EXCEEDED";
inline constexpr char kDiskFull[] = "DISK_FULL";
inline constexpr char kBusy[] = "BUSY";
inline constexpr char kOutOfMemory[] = "OUT_OF_MEMORY";
inline constexpr char kShuttingDown[] = "SHUTTING_DOWN";
inline constexpr char kDatabaseAway[] = "DATABASE_AWAY";
inline constexpr char kOwnedElsewhere[] = "OWNED_ELSEWHERE";
inline constexpr char kAnotherWriter[] = "ANOTHER_WRITER";

// Returns a status with these details. `code` must not be OK and the reason must not be empty.
absl::Status Refuse(absl::StatusCode code, absl::string_view message, const Refusal& refusal);
// Returns RESOURCE_EXHAUSTED for a limit that is still exceeded after waiting.
absl::Status LimitExceeded(absl::string_view limit, absl::string_view message);
// Returns the details of a status; none if it has no reason.
std::optional<Refusal> RefusalOf(const absl::Status& status);

}  // namespace polyest::internal
