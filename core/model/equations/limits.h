#pragma once

// Limits on the size, the nesting and the evaluation time of equations, which may come as text from
// an untrusted user.

#include <cstddef>

namespace polyest::internal::equations {

inline constexpr size_t kMaxNameLength = 64;      // bytes
inline constexpr size_t kMaxTextLength = 8192;    // bytes per expression
inline constexpr size_t kMaxTextInAll = 262'144;  // bytes of all expressions of a model together
inline constexpr int kMaxNesting = 100;  // depth of nested parentheses, calls, signs and powers
inline constexpr size_t kMaxStates = 100;
inline constexpr size_t kMaxExpressions = 1000;  // right-hand sides, outputs and intermediates
inline constexpr size_t kMaxNames = 2000;        // for parameters, inputs and units separately
inline constexpr size_t kMaxTables = 100;
inline constexpr size_t kMaxTableValues = 100'000;  // per table
inline constexpr size_t kMaxTableValuesInAll = 400'000;
inline constexpr int kMaxNodes = 20'000;  // distinct operations of a model
inline constexpr int kMaxJacobianNodes =
    60'000;  // including the Jacobian; a larger Jacobian is left out
// Conditions of a model that are located; a model with more is integrated as if it were smooth.
inline constexpr size_t kMaxSwitches = 200;
inline constexpr int kMaxRegisters = 4096;  // values held at once; each takes 512 bytes per thread
inline constexpr int kMaxArguments = 100;   // arguments of min and max

}  // namespace polyest::internal::equations
