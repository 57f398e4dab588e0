#include "server/journal/postgres_owner.h"

#include <absl/strings/str_format.h>

#include <chrono>

#include "proto/wire/refusal/refusal.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {
namespace {

// Time after which the session's present owner is known.
constexpr std::chrono::milliseconds kTakenDelay{200};

}  // namespace

absl::Status TakenOver() {
  return Refuse(absl::StatusCode::kUnavailable, "another daemon has taken the session over",
                {.reason = kOwnedElsewhere, .retry_delay = kTakenDelay});
}

absl::Status DoesNotFollow(int64_t sequence) {
  return absl::FailedPreconditionError(
      absl::StrFormat("batch %d does not follow what the journal has", sequence));
}

absl::Status JudgeOwned(const PostgresResult& result) {
  if (result.Flag(0, 0)) return absl::OkStatus();
  if (!result.Flag(0, 2)) return NoSuchSession();
  return result.Flag(0, 1) ? absl::FailedPreconditionError("the journal is as it was")
                           : TakenOver();
}

}  // namespace polyest::internal
