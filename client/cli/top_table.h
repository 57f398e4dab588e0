#pragma once

// Prints the table of `polyest top`.

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
  double time_s = 0;  // time of a monotonic clock
};

// Prints a daemon and its sessions. `before`, which may be null, is an earlier view of the same
// daemon for the computation of rates. On a screen, the least important columns are left out until
// the table fits its width; with `fit_rows`, the last sessions that do not fit its height are left
// out, too.
void PrintTop(const DaemonView& now, const DaemonView* before, bool fit_rows, std::ostream& out);

// Returns a duration as "45 s", "12 min", "3.2 h" or "8.0 d".
std::string FormatDuration(double seconds);
// Returns a number of bytes as "512 B", "1.5 KiB" or "2.0 GiB".
std::string FormatBytes(int64_t bytes);

}  // namespace polyest::internal
