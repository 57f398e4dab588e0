#pragma once

// Macros that return early on a status that is not OK.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <utility>

#define POLYEST_RETURN_IF_ERROR(expression)                                 \
  do {                                                                      \
    if (absl::Status status_ = (expression); !status_.ok()) return status_; \
  } while (false)

#define POLYEST_CONCATENATE_INNER(a, b) a##b
#define POLYEST_CONCATENATE(a, b) POLYEST_CONCATENATE_INNER(a, b)

// POLYEST_ASSIGN_OR_RETURN(auto x, F()) sets x to F's value or returns F's status.
#define POLYEST_ASSIGN_OR_RETURN(declaration, expression) \
  POLYEST_ASSIGN_OR_RETURN_INNER(POLYEST_CONCATENATE(status_or_, __LINE__), declaration, expression)
#define POLYEST_ASSIGN_OR_RETURN_INNER(temporary, declaration, expression) \
  auto temporary = (expression);                                           \
  if (!temporary.ok()) return std::move(temporary).status();               \
  declaration = std::move(temporary).value()
