#pragma once

// Lists the sessions of a daemon, for `polyest list` and `polyest top`.

#include <absl/status/statusor.h>

#include <ostream>

#include "polyest/client.h"

namespace polyest::internal {

// Returns all sessions, following the daemon's pages.
absl::StatusOr<v1::ListSessionsResponse> ListAllSessions(Client& client);

// Prints one line per session: its name, the amount of data, its state, the time since its last use
// and the time of its creation.
void PrintSessions(const v1::ListSessionsResponse& list, std::ostream& out);

}  // namespace polyest::internal
