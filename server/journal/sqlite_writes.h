#pragma once

// The statements with which the journal writes the batches and what is computed of them.

#include <absl/status/status.h>

#include "server/journal/session_journal.h"
#include "server/journal/sqlite_database.h"

namespace polyest::internal {

// Runs a statement whose one parameter is the number of a session.
absl::Status RunForSession(SqliteDatabase& database, const char* sql, int64_t session);

// These do what SessionJournal::Append, SaveSnapshot and SaveHistoryPoint say.
absl::Status InsertBatch(SqliteDatabase& database, const JournalEntry& entry);
absl::Status ReplaceSnapshot(SqliteDatabase& database, int64_t session,
                             const JournalSnapshot& snapshot);
absl::Status InsertHistoryPoint(SqliteDatabase& database, int64_t session,
                                const JournalHistoryPoint& point, int64_t stride);

}  // namespace polyest::internal
