#pragma once

// Counts calls of malloc, by which Eigen allocates: this definition replaces the C library's and
// passes calls on to it. One file of a program may include it. Sanitizers bring their own malloc:
// POLYEST_COUNTS_ALLOCATIONS is 0 under them, and nothing is counted.

#include <cstddef>

#include "core/common/sanitizer.h"

#if POLYEST_ADDRESS_SANITIZER || POLYEST_THREAD_SANITIZER || !defined(__GLIBC__)

#define POLYEST_COUNTS_ALLOCATIONS 0

#else

#define POLYEST_COUNTS_ALLOCATIONS 1

namespace polyest::testing {
// Number of allocations of the calling thread.
inline thread_local int allocations = 0;
}  // namespace polyest::testing

extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++polyest::testing::allocations;
  return __libc_malloc(size);
}

#endif
