#pragma once

// Declares the kernels of Eigen's general matrix products, which product_kernels.cc compiles once.
// Every source that multiplies two matrices would otherwise compile them again, for seconds each.
// The products themselves are written as usual, `a * b`.

#include <Eigen/Core>

// POLYEST_PRODUCT_KERNELS(extern) declares them, POLYEST_PRODUCT_KERNELS() instantiates them.
#define POLYEST_PRODUCT_KERNELS(extern_or_nothing)                                                 \
  extern_or_nothing template struct gebp_kernel<double, double, Eigen::Index, ResultMapper,        \
                                                KernelTraits::mr, KernelTraits::nr, false, false>; \
  POLYEST_PRODUCT_PACKING(extern_or_nothing, Eigen::ColMajor)                                      \
  POLYEST_PRODUCT_PACKING(extern_or_nothing, Eigen::RowMajor)                                      \
  POLYEST_PRODUCT(extern_or_nothing, Eigen::ColMajor, Eigen::ColMajor)                             \
  POLYEST_PRODUCT(extern_or_nothing, Eigen::ColMajor, Eigen::RowMajor)                             \
  POLYEST_PRODUCT(extern_or_nothing, Eigen::RowMajor, Eigen::ColMajor)                             \
  POLYEST_PRODUCT(extern_or_nothing, Eigen::RowMajor, Eigen::RowMajor)

#define POLYEST_PRODUCT_PACKING(extern_or_nothing, order)                                     \
  extern_or_nothing template struct gemm_pack_lhs<                                            \
      double, Eigen::Index, FactorMapper<order>, KernelTraits::mr, KernelTraits::LhsProgress, \
      KernelTraits::LhsPacket4Packing, order, false, false>;                                  \
  extern_or_nothing template struct gemm_pack_rhs<double, Eigen::Index, FactorMapper<order>,  \
                                                  KernelTraits::nr, order, false, false>;

#define POLYEST_PRODUCT(extern_or_nothing, left, right)                                          \
  extern_or_nothing template struct general_matrix_matrix_product<                               \
      Eigen::Index, double, left, false, double, right, false, Eigen::ColMajor, 1>;              \
  extern_or_nothing template struct general_matrix_vector_product<                               \
      Eigen::Index, double, FactorMapper<left>, left, false, double, FactorMapper<right>, false, \
      0>;

namespace Eigen::internal {

using KernelTraits = gebp_traits<double, double>;
using ResultMapper = blas_data_mapper<double, Eigen::Index, Eigen::ColMajor, Unaligned, 1>;
template <int order>
using FactorMapper = const_blas_data_mapper<double, Eigen::Index, order>;

POLYEST_PRODUCT_KERNELS(extern)

}  // namespace Eigen::internal
