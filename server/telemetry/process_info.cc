#include "server/telemetry/process_info.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

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

int64_t OpenDescriptors() {
  std::error_code error;
  std::filesystem::directory_iterator entries("/proc/self/fd", error);
  if (error) return 0;
  // One of them is the iterator's own.
  return std::distance(begin(entries), end(entries)) - 1;
}

}  // namespace polyest::internal
