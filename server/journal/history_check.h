#pragma once

// Verifies the histories of estimates in a backup. The journal has no digests of them, so a backup
// gets those of the histories that it was made with, in a table of its own.

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "server/journal/sqlite_database.h"

namespace polyest::internal {

// Writes the digests into a table of a backup.
absl::Status WriteHistoryDigests(SqliteDatabase& database);
// Removes that table, if it is there.
absl::Status DropHistoryDigests(SqliteDatabase& database);

// Adds a sentence to `damage` for each session with a point that cannot be read, or with another
// history than the backup was made with. A file without the table is checked for the points alone.
absl::Status CheckHistories(SqliteDatabase& database, std::vector<std::string>& damage);

}  // namespace polyest::internal
