#pragma once

// Verifies a journal's file completely: its structure, the digests of all sessions and batches, the
// histories of estimates, and the seals of a backup.

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "polyest/stop.h"
#include "server/journal/journal_backup.h"
#include "server/journal/session_seals.h"
#include "server/journal/sqlite_database.h"

namespace polyest::internal {

// Writes the seals and the digests of the histories into tables of a backup, which is one file and
// has no other place for them.
absl::Status WriteBackupSeals(SqliteDatabase& database, const std::vector<Seal>& seals);
// Returns the seals of a backup; none where there is no such table.
absl::StatusOr<std::vector<Seal>> ReadBackupSeals(SqliteDatabase& database);
// Puts the seals of a restored backup into their file if that has just been made, and removes both
// tables.
absl::Status RestoreBackupSeals(SqliteDatabase& database, SessionSeals& seals);

// Reads all of a database and returns what it has. FAILED_PRECONDITION when it is no journal, or
// one of another version; DATA_LOSS when it is no database.
absl::StatusOr<JournalContents> CheckJournal(SqliteDatabase& database, const Stop& stop);

// Reads all of a file that no daemon uses, as CheckJournal does, and leaves it as it is. NOT_FOUND
// when there is no such file; all errors name it.
absl::StatusOr<JournalContents> CheckJournalFile(const std::string& file);

}  // namespace polyest::internal
