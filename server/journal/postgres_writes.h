#pragma once

// The statements by which sessions change in PostgreSQL. Those of a session that exists carry the
// epoch of its owner and do nothing when that is not the present one.

#include <string_view>

#include "server/journal/batch_parts.h"
#include "server/journal/postgres_owner.h"
#include "server/journal/postgres_writer.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

// Inserts the row of a session and that of its owner, with epoch 1. ALREADY_EXISTS when the name is
// taken.
void SendSession(PostgresWriter& writer, const SessionHead& head, bool hidden,
                 std::string_view problem, std::string_view digest, int64_t node);
// The following are NOT_FOUND when there is no such session, and UNAVAILABLE when it has another
// owner or epoch.
void SendShow(PostgresWriter& writer, int64_t session, std::string_view digest,
              const PostgresOwner& owner);
void SendDelete(PostgresWriter& writer, int64_t session, const PostgresOwner& owner);
// Sends a part that is not the last one; it replaces one that is left of an earlier attempt.
// FAILED_PRECONDITION when the batch does not follow the last one.
void SendPart(PostgresWriter& writer, const JournalEntry& entry, const BatchPart& part,
              const PostgresOwner& owner);
// Sends the removal of the parts of a batch that was refused.
void SendRemovalOfParts(PostgresWriter& writer, const JournalEntry& entry,
                        const PostgresOwner& owner);
// Do nothing when there is no such session, owner or batch.
void SendSnapshot(PostgresWriter& writer, int64_t session, const JournalSnapshot& snapshot,
                  const PostgresOwner& owner);
void SendHistoryPoint(PostgresWriter& writer, int64_t session, const JournalHistoryPoint& point,
                      int64_t stride, const PostgresOwner& owner);

}  // namespace polyest::internal
