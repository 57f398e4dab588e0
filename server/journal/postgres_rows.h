#pragma once

// The queries by which sessions are read from PostgreSQL.

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "server/journal/postgres_pool.h"
#include "server/journal/session_journal.h"
#include "server/journal/session_row.h"

namespace polyest::internal {

// Return the heads of visible sessions, in the order of tenants and names: of all, of those of a
// tenant with names after `after`, and of the one with this name, if there is one.
absl::StatusOr<std::vector<SessionHead>> ReadHeads(PostgresPool& pool);
absl::StatusOr<std::vector<SessionHead>> ReadHeadsAfter(PostgresPool& pool,
                                                        const std::string& tenant,
                                                        const std::string& after, int64_t count);
absl::StatusOr<std::optional<SessionHead>> FindHead(PostgresPool& pool, const std::string& tenant,
                                                    const std::string& name);
// Returns the row of a session; NOT_FOUND when there is none.
absl::StatusOr<SessionRow> ReadRow(PostgresPool& pool, int64_t session);
// Returns some batches after batch `after`: sequence, measurements and digest. One row with the
// sequence 0 says that there are no more; NOT_FOUND, that there is no such session.
absl::StatusOr<PostgresResult> ReadPage(PostgresPool& pool, int64_t session, int64_t after);

}  // namespace polyest::internal
