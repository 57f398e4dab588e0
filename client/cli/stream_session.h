#pragma once

// The session that `polyest stream` writes to.

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "polyest/client.h"

namespace polyest::internal {

struct RowPlace {
  int run = 0;
  double time_s = 0;
};

struct StreamSession {
  std::string name;  // `sessions/{id}`
  // The last row that it has; none if it is new.
  std::optional<RowPlace> resumed_after;
};

// Creates the session, or resumes the one of that name if its problem is the same. `id` empty: the
// daemon chooses.
absl::StatusOr<StreamSession> OpenSession(Client& client, const v1::Problem& problem,
                                          const std::string& id);

// Removes the leading rows up to and including `place`; returns how many.
int RemoveRowsUpTo(const RowPlace& place, v1::Measurements& batch);

}  // namespace polyest::internal
