#pragma once

// The table of `polyest top`.

#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "polyest/v1/session_service.pb.h"
#include "polyest/v1/status_service.pb.h"

namespace polyest::internal {

// The state of a daemon and its sessions at one time.
struct DaemonView {
  v1::DaemonStatus status;
  std::vector<v1::Session> sessions;
  double time_s = 0;  // on a clock that does not jump
};

// Prints a daemon and its sessions. `before` is an earlier look at the same daemon, from which
// rates follow; it may be null. On a screen, the columns that matter least are left out until the
// rest fits its width; with `fit_rows`, so are the last sessions that its height has no room for.
void PrintTop(const DaemonView& now, const DaemonView* before, bool fit_rows, std::ostream& out);

// Returns "45 s", "12 min", "3.2 h" or "8.0 d".
std::string FormatDuration(double seconds);
// Returns "512 B", "1.5 KiB" or "2.0 GiB".
std::string FormatBytes(int64_t bytes);

}  // namespace polyest::internal
