#include "core/common/product_kernels.h"

namespace Eigen::internal {

POLYEST_PRODUCT_KERNELS()

}  // namespace Eigen::internal
