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

absl::Status JudgeOwned(const PostgresResult& result) {
  if (result.Flag(0, 0)) return absl::OkStatus();
  if (!result.Flag(0, 2)) return NoSuchSession();
  if (result.Flag(0, 1)) return absl::FailedPreconditionError("the journal is as it was");
  return Refuse(absl::StatusCode::kUnavailable, "another daemon has taken the session over",
                {.reason = kOwnedElsewhere, .retry_delay = kTakenDelay});
}

absl::Status JudgeBatch(const PostgresResult& result, int64_t sequence) {
  const absl::Status judged = JudgeOwned(result);
  if (!absl::IsFailedPrecondition(judged)) return judged;
  return absl::FailedPreconditionError(
      absl::StrFormat("batch %d does not follow what the journal has", sequence));
}

}  // namespace polyest::internal
