#pragma once

// What `polyest top` shows.

#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "polyest/v1/estimation_service.pb.h"

namespace polyest {

// How a daemon and its sessions are at one time.
struct DaemonView {
  v1::DaemonStatus status;
  std::vector<v1::Session> sessions;
  double time_s = 0;  // on a clock that does not jump
};

// `before`: an earlier look at the same daemon, from which rates follow; may be null.
void PrintTop(const DaemonView& now, const DaemonView* before, std::ostream& out);

// "45 s", "12 min", "3.2 h", "8.0 d".
std::string FormatDuration(double seconds);
// "512 B", "1.5 KiB", "2.0 GiB".
std::string FormatBytes(int64_t bytes);

}  // namespace polyest
