#include "server/telemetry/process_info.h"

#include <unistd.h>

#include <fstream>

namespace polyest::internal {

std::string Version() { return POLYEST_VERSION; }

int64_t ResidentMemoryBytes() {
  // The file begins with two numbers of pages: those of the address space, and those that are
  // resident.
  std::ifstream statm("/proc/self/statm");
  int64_t all = 0;
  int64_t resident = 0;
  if (!(statm >> all >> resident)) return 0;
  return resident * sysconf(_SC_PAGESIZE);
}

}  // namespace polyest::internal
