#pragma once

// Opens the session that `polyest stream` writes to.

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
  // The last row of the resumed session; none if the session has no rows.
  std::optional<RowPlace> resumed_after;
};

// Creates the session `id`, whose rows may be out of order within `reorder_window_s`, or resumes it
// if it exists with the same problem. If `id` is empty, the daemon chooses the name. ALREADY_EXISTS
// if the session has another problem or another window, or if it has rows and a window: its last
// row does not tell then which rows it has.
absl::StatusOr<StreamSession> OpenSession(Client& client, const v1::Problem& problem,
                                          const std::string& id, double reorder_window_s);

// Checks that the first row of `batch`, whose times count from it, is the first row that the
// session has of its run, or is of a later run than the session has. Otherwise the times of the two
// would count from different rows: INVALID_ARGUMENT, which names `data` and says what to do.
absl::Status CheckZeroOfTime(Client& client, const StreamSession& session,
                             const v1::Measurements& batch, const std::string& data);

// Removes the leading rows up to and including `place` and returns their number.
int RemoveRowsUpTo(const RowPlace& place, v1::Measurements& batch);

}  // namespace polyest::internal
