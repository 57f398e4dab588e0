#pragma once

// The session that `polyest stream` writes to.

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "client/cpp/client.h"

namespace polyest {

struct StreamSession {
  std::string name;  // `sessions/{id}`
  // The time of the last sample that it has; none if it is new. Rows of run 0 up to there are in
  // it already.
  std::optional<double> resumed_after_s;
};

// Creates the session, or resumes the one of that name if its problem is the same. `id` empty: the
// daemon chooses.
absl::StatusOr<StreamSession> OpenSession(Client& client, const v1::Problem& problem,
                                          const std::string& id);

// Takes leading rows of run 0 with times up to `time_s` away; returns how many.
int RemoveRowsUpTo(double time_s, v1::Measurements& batch);

}  // namespace polyest
