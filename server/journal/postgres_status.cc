#include "server/journal/postgres_status.h"

#include <absl/strings/str_format.h>

#include <chrono>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

constexpr std::chrono::seconds kAwayDelay{1};

struct Mapped {
  std::string_view prefix;  // of the SQLSTATE
  absl::StatusCode code;
};

// The first entry that fits holds.
constexpr Mapped kStates[] = {
    {"08", absl::StatusCode::kUnavailable},        // connection
    {"23505", absl::StatusCode::kAlreadyExists},   // unique_violation
    {"25006", absl::StatusCode::kUnavailable},     // read_only_sql_transaction: a standby
    {"25P03", absl::StatusCode::kUnavailable},     // idle_in_transaction_session_timeout
    {"28", absl::StatusCode::kUnavailable},        // authorization: the daemon's, not a client's
    {"40", absl::StatusCode::kUnavailable},        // rollback: deadlock, serialization
    {"53300", absl::StatusCode::kUnavailable},     // too_many_connections
    {"53", absl::StatusCode::kResourceExhausted},  // disk, memory
    {"54", absl::StatusCode::kResourceExhausted},  // program limits
    {"55P03", absl::StatusCode::kUnavailable},     // lock_not_available
    {"57", absl::StatusCode::kUnavailable},        // cancelled, time-out, shut down, starting up
    {"58", absl::StatusCode::kUnavailable},        // the server's disk fails
    {"XX001", absl::StatusCode::kDataLoss},        // data_corrupted
    {"XX002", absl::StatusCode::kDataLoss},        // index_corrupted
};

absl::StatusCode CodeOfSqlState(std::string_view state) {
  for (const Mapped& mapped : kStates) {
    if (state.starts_with(mapped.prefix)) return mapped.code;
  }
  return absl::StatusCode::kInternal;
}

}  // namespace

absl::Status FromSqlState(std::string_view state, std::string_view said) {
  const absl::StatusCode code = CodeOfSqlState(state);
  if (code == absl::StatusCode::kUnavailable) return DatabaseAway(said);
  const std::string message = absl::StrFormat("the database: %s (SQLSTATE %s)", said, state);
  if (state.starts_with("53100")) {
    return Refuse(code, message, {.reason = kDiskFull, .retry_delay = kAwayDelay});
  }
  return absl::Status(code, message);
}

absl::Status DatabaseAway(std::string_view what) {
  return Refuse(absl::StatusCode::kUnavailable,
                absl::StrFormat("the database that keeps the sessions is away: %s", what),
                {.reason = kDatabaseAway, .retry_delay = kAwayDelay});
}

}  // namespace polyest::internal
