#pragma once

// Digests of the sessions' own rows in the journal's database: of names, windows and problems, so
// that a damaged one is noticed and not served.

#include <absl/status/statusor.h>

#include <string>
#include <string_view>

#include "server/journal/session_journal.h"
#include "server/journal/sqlite_database.h"

namespace polyest::internal {

// Returns the digest of a session's row. The place of the head is not part of it.
std::string SessionDigest(const SessionHead& head, bool hidden, std::string_view problem);

// Writes the digest of a session's row as it is now; nothing if there is no such session.
absl::Status WriteSessionDigest(SqliteDatabase& database, int64_t session);
// Writes the digests of all sessions. For a file that has none yet.
absl::Status WriteAllSessionDigests(SqliteDatabase& database);
// Deletes the sessions that were never shown: those of imports that did not come to their end.
// Leaves damaged ones, because a damaged row does not tell what was hidden.
absl::Status DeleteHidden(SqliteDatabase& database);

}  // namespace polyest::internal
