#pragma once

// Defines the tables of the journal's file, and upgrades a file of an earlier version.

#include <absl/status/status.h>

#include <string>

#include "server/journal/sqlite_database.h"

namespace polyest::internal {

// Returns the newest version.
int JournalSchemaVersion();

// Checks that a database is a journal of the newest version. FAILED_PRECONDITION says what it is
// instead; DATA_LOSS when it is no database or a damaged one.
absl::Status CheckJournalVersion(SqliteDatabase& database);

// Makes the tables in an empty file, or upgrades those of an earlier version to `version`,
// completely or not at all. FAILED_PRECONDITION, with the file as it was, when it belongs to
// another program or to a later version; DATA_LOSS when it is no database or a damaged one.
absl::Status PrepareSchema(SqliteDatabase& database, int version = JournalSchemaVersion());

}  // namespace polyest::internal
