#pragma once

// The Eigen names that the whole library shares. Sources of the library include this header, which
// also declares that the products' kernels are compiled elsewhere. Users include polyest/types.h,
// since they may compile for another processor.

#include <limits>

#include "core/common/product_kernels.h"
#include "polyest/types.h"

namespace polyest::internal {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace polyest::internal
