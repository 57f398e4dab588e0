#pragma once

#include <cstdint>
#include <string>

namespace polyest::internal {

// Returns the version of polyest.
std::string Version();

// Returns the resident memory of this process, bytes; 0 where the operating system does not say.
int64_t ResidentMemoryBytes();

// Returns the number of descriptors that this process has open; 0 where the operating system does
// not say.
int64_t OpenDescriptors();

}  // namespace polyest::internal
