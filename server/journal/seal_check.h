#pragma once

// Compares the journal's database with the seals when it is opened.

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "server/journal/session_seals.h"
#include "server/journal/sqlite_database.h"

namespace polyest::internal {

// Returns a sentence for each session that is damaged or lacks acknowledged batches, and for each
// that is missing. Brings the seals up to date where they are behind the database; leaves those
// that are ahead, so that the loss is said again until other batches take the place of the lost
// ones.
absl::StatusOr<std::vector<std::string>> CheckSeals(SqliteDatabase& database, SessionSeals& seals);

// Returns how people know a session.
std::string SealLabel(const std::string& tenant, const std::string& name);

}  // namespace polyest::internal
