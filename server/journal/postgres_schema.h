#pragma once

// Defines the tables of the journal in a PostgreSQL database, in the schema polyest, and upgrades
// those of an earlier version.

#include <absl/status/status.h>

#include "server/journal/postgres_connection.h"

namespace polyest::internal {

// Returns the newest version.
int64_t PostgresSchemaVersion();

// Makes the tables, or upgrades them to the newest version, completely or not at all; waits for
// another daemon that is doing the same. FAILED_PRECONDITION, with the database as it was, when the
// schema polyest belongs to another program or to a later version, when the user may not make it,
// and when the server does not wait for its disk (fsync = off).
absl::Status PreparePostgresSchema(PostgresConnection& connection);

}  // namespace polyest::internal
