#pragma once

// The statements for batches that are kept in parts (batch_parts.h).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>

#include "server/journal/batch_parts.h"
#include "server/journal/sqlite_database.h"

namespace polyest::internal {

// Inserts a part that is not the last one; replaces one that is left of an earlier attempt. Errors:
// those of InsertBatch.
absl::Status InsertPart(SqliteDatabase& database, const JournalEntry& entry, const BatchPart& part);
// Returns the measurements of a batch: the `part_count` parts that are kept apart, then `last`.
absl::StatusOr<std::string> JoinParts(SqliteDatabase& database, int64_t session, int64_t sequence,
                                      int64_t part_count, std::string last);
// Removes parts of a session, of about so many bytes. Returns false when it has none left.
absl::StatusOr<bool> RemoveSomeParts(SqliteDatabase& database, int64_t session, int64_t max_bytes);
// Removes the parts of a batch that was refused.
absl::Status RemoveRefused(SqliteDatabase& database, const JournalEntry& entry);
// Removes parts without the row of a batch, in several commits.
absl::Status DeleteUnfinishedParts(SqliteDatabase& database);

}  // namespace polyest::internal
