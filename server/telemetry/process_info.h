#pragma once

#include <cstdint>
#include <string>

namespace polyest::internal {

// Of polyest.
std::string Version();

// Of this process, resident; 0 where the operating system does not say.
int64_t ResidentMemoryBytes();

}  // namespace polyest::internal
