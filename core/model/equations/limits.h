#pragma once

// What bounds the size, the depth and the time of equations that come as text from anybody.

#include <cstddef>

namespace polyest::equations {

inline constexpr size_t kMostNameLength = 64;      // bytes
inline constexpr size_t kMostTextLength = 8192;    // bytes of one expression
inline constexpr size_t kMostTextInAll = 262'144;  // bytes of all expressions of a model
inline constexpr int kMostNesting = 100;  // parentheses, calls, signs and powers in one another
inline constexpr size_t kMostStates = 100;
inline constexpr size_t kMostExpressions = 1000;  // right-hand sides, outputs and intermediates
inline constexpr size_t kMostNames = 2000;        // parameters, inputs and units, each
inline constexpr size_t kMostTables = 100;
inline constexpr size_t kMostTableValues = 100'000;  // of one table
inline constexpr size_t kMostTableValuesInAll = 400'000;
inline constexpr int kMostNodes = 20'000;  // distinct operations of a model
inline constexpr int kMostJacobianNodes =
    60'000;                                  // the same with its Jacobian; past it there is none
inline constexpr int kMostRegisters = 4096;  // intermediate values at once, 512 bytes each a thread
inline constexpr int kMostArguments = 100;   // of min and max

}  // namespace polyest::equations
