#pragma once

// The statements with which the journal writes the batches and what is computed of them.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <vector>

#include "server/journal/batch_parts.h"
#include "server/journal/session_journal.h"
#include "server/journal/sqlite_database.h"

namespace polyest::internal {

// Says why a batch, or a part of one, could not be inserted.
absl::Status BatchRefused(SqliteDatabase& database, const JournalEntry& entry);

// Runs a statement whose one parameter is the number of a session.
absl::Status RunForSession(SqliteDatabase& database, const char* sql, int64_t session);

// Returns the first rows that a query finds, until they have so many bytes. Its columns are a row
// and the size of it.
absl::StatusOr<std::vector<int64_t>> FirstRows(SqliteQuery& query, int64_t bytes);
// Runs a statement whose one parameter is a row for each of them. Returns whether there are any.
absl::StatusOr<bool> RunForRows(SqliteDatabase& database, const char* sql,
                                const std::vector<int64_t>& rows);

// These do what SessionJournal::Append, SaveSnapshot and SaveHistoryPoint say.
absl::Status InsertBatch(SqliteDatabase& database, const JournalEntry& entry,
                         const BatchPart& last);
absl::Status ReplaceSnapshot(SqliteDatabase& database, int64_t session,
                             const JournalSnapshot& snapshot);
absl::Status InsertHistoryPoint(SqliteDatabase& database, int64_t session,
                                const JournalHistoryPoint& point, int64_t stride);

}  // namespace polyest::internal
