#pragma once

// What bounds the size, the depth and the time of equations that come as text from anybody.

#include <cstddef>

namespace polyest::internal::equations {

inline constexpr size_t kMaxNameLength = 64;      // bytes
inline constexpr size_t kMaxTextLength = 8192;    // bytes of one expression
inline constexpr size_t kMaxTextInAll = 262'144;  // bytes of all expressions of a model
inline constexpr int kMaxNesting = 100;  // parentheses, calls, signs and powers in one another
inline constexpr size_t kMaxStates = 100;
inline constexpr size_t kMaxExpressions = 1000;  // right-hand sides, outputs and intermediates
inline constexpr size_t kMaxNames = 2000;        // parameters, inputs and units, each
inline constexpr size_t kMaxTables = 100;
inline constexpr size_t kMaxTableValues = 100'000;  // of one table
inline constexpr size_t kMaxTableValuesInAll = 400'000;
inline constexpr int kMaxNodes = 20'000;  // distinct operations of a model
inline constexpr int kMaxJacobianNodes =
    60'000;                                 // the same with its Jacobian; past it there is none
inline constexpr int kMaxRegisters = 4096;  // intermediate values at once, 512 bytes each a thread
inline constexpr int kMaxArguments = 100;   // of min and max

}  // namespace polyest::internal::equations
