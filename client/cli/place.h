#pragma once

// Where a command computes, and for how long at most.

#include <chrono>
#include <optional>
#include <string>

namespace polyest::internal {

// Files and names for access to a daemon; an empty field is not used.
struct ServerAccess {
  std::string ca_file;
  std::string certificate_file;
  std::string key_file;
  std::string server_name;
  std::string token_file;
};

// Place where a command computes: a daemon or this process.
struct Place {
  using Clock = std::chrono::steady_clock;

  // Returns when the command must have ended; nothing without a limit.
  std::optional<Clock::time_point> End() const {
    if (!(deadline_s > 0)) return std::nullopt;
    const std::chrono::duration<double> length(deadline_s);
    return start + std::chrono::duration_cast<Clock::duration>(length);
  }

  std::string server;        // HOST:PORT; empty: in this process
  ServerAccess access;       // access to the server
  double deadline_s = 0;     // longest duration, s; 0: no limit
  int threads = 1;           // threads for computing in this process
  std::string fmu_dir;       // folder of FMUs for this process; empty: none
  std::string umbridge_dir;  // likewise, of descriptions of models of UM-Bridge servers
  Clock::time_point start = Clock::now();  // of the command
};

}  // namespace polyest::internal
