#pragma once

// What the journal's file looks like, and how a file of an earlier version becomes one of this.

#include <absl/status/status.h>

#include <string>

#include "server/journal/sqlite_database.h"

namespace polyest::internal {

// The newest there is.
int JournalSchemaVersion();

// Makes the tables in an empty file, or brings those of an earlier version up to `version`, all of
// it or nothing. FAILED_PRECONDITION, with the file as it was, when it belongs to another program
// or to a later version; DATA_LOSS when it is no database or a damaged one.
absl::Status PrepareSchema(SqliteDatabase& database, int version = JournalSchemaVersion());

}  // namespace polyest::internal
