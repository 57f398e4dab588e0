#pragma once

// The sessions of a daemon, for `polyest list` and `polyest top`.

#include <absl/status/statusor.h>

#include <ostream>

#include "polyest/client.h"

namespace polyest::internal {

// Returns all sessions, following the daemon's pages.
absl::StatusOr<v1::ListSessionsResponse> ListAllSessions(Client& client);

// Prints one line a session: its name, what it holds, whether data are coming in, when it was made.
void PrintSessions(const v1::ListSessionsResponse& list, std::ostream& out);

}  // namespace polyest::internal
