#pragma once

// POLYEST_CHECK(condition) throws CheckFailure, in every build, if the condition is false, which is
// a programmer's error. Bad input is never checked this way; it is an absl::Status. An exception,
// since a daemon hosts many sessions, and a fault that one of them shows must not end the others.

#include <stdexcept>
#include <string>

namespace polyest::internal {

class CheckFailure : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

[[noreturn, gnu::cold]] inline void FailCheck(const char* file, int line, const char* condition) {
  throw CheckFailure(std::string(file) + ":" + std::to_string(line) +
                     ": check failed: " + condition);
}

}  // namespace polyest::internal

#define POLYEST_CHECK(condition)                                      \
  do {                                                                \
    if (!(condition)) [[unlikely]]                                    \
      ::polyest::internal::FailCheck(__FILE__, __LINE__, #condition); \
  } while (false)
