#pragma once

// Maps PostgreSQL's errors to absl::Status. Messages name neither the database's address nor its
// user, because clients see them.

#include <absl/status/status.h>

#include <string_view>

namespace polyest::internal {

// Returns the status of an SQLSTATE, which has five characters: UNAVAILABLE when the connection,
// the server, a lock or the time for a statement is lost, or when the server only reads;
// RESOURCE_EXHAUSTED when its disk, its memory or one of its limits is full; ALREADY_EXISTS when a
// unique name is taken; DATA_LOSS when its data is damaged; INTERNAL otherwise. `said` is the
// server's own primary message.
absl::Status FromSqlState(std::string_view state, std::string_view said);

// Returns UNAVAILABLE for a database that cannot be reached or does not answer; trying again later
// may help.
absl::Status DatabaseAway(std::string_view what);

}  // namespace polyest::internal
