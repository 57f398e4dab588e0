#pragma once

// POLYEST_CHECK(condition) aborts the program, in every build, if the condition is false, which is
// a programmer's error. Bad input is never checked this way; it is an absl::Status.

#include <cstdio>
#include <cstdlib>

#define POLYEST_CHECK(condition)                                                         \
  do {                                                                                   \
    if (!(condition)) [[unlikely]] {                                                     \
      std::fprintf(stderr, "%s:%d: check failed: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                      \
    }                                                                                    \
  } while (false)
